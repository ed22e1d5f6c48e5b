/** Keys that control the time, unless the focused element uses them. */

/** Return the actions of the keys that control the time. With Shift, an arrow is `longStep` steps. */
export function listTimeActions({ shiftKey }, player, longStep) {
  const distance = shiftKey ? longStep : 1;
  return {
    " ": () => player.toggle(),
    ArrowLeft: () => player.step(-distance),
    ArrowRight: () => player.step(distance),
  };
}

/**
 * Run the action of a key, unless the focused element uses the key.
 * @param {KeyboardEvent} event
 * @param {HTMLElement|undefined} slider its keys control the complete view
 * @param {Object<string, () => void>} actions by key
 */
export function handleKey(event, slider, actions) {
  if (
    event.ctrlKey ||
    event.metaKey ||
    event.altKey ||
    !Object.hasOwn(actions, event.key) ||
    usesKey(event, slider)
  )
    return;
  event.preventDefault();
  actions[event.key]();
}

/** Return whether the focused element uses this key itself. */
function usesKey({ target, key }, slider) {
  if (target.matches?.("select, textarea, input:not([type=range], [type=checkbox])")) return true;
  if (target.matches?.("button, a, summary, input[type=checkbox]")) return key === " ";
  return (
    target.matches?.("input[type=range]") && target !== slider && /^(Arrow|Home|End|Page)/.test(key)
  );
}
