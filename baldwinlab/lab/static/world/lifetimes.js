/** Open lifetimes: as recordings, or as frames if the world has many agents. */

import { getBinary } from "../core/common.js";
import { FrameStream } from "./frame_stream.js";
import { Lifetime, Recording } from "./recording.js";
import { createLifetimeQuery } from "../core/sources.js";

// A recording of more agents would have gigabytes.
const MAX_RECORDED_AGENTS = 4000;
// Agent-steps per request, about 17 MB.
const PART_AGENT_STEPS = 1_300_000;
const MIN_PART_STEPS = 100;

/**
 * Return a function that opens a lifetime.
 * @param {import("../core/sources.js").Source} source
 * @param {{agents?: number, steps?: number}} size of the world; an unknown number is missing
 * @returns {(changed: () => void, failed: (fault: Error) => void) => Lifetime|FrameStream} `changed`
 *   is called when something is loaded, and `failed` after an error
 */
export function openLifetime(source, { agents, steps }) {
  const fetch = (kind, query, signal) => {
    const parameters = createLifetimeQuery(source);
    for (const [name, value] of Object.entries(query ?? {})) parameters.set(name, value);
    return getBinary(`api/${kind}?${parameters}`, signal);
  };
  if (agents > MAX_RECORDED_AGENTS)
    return (...callbacks) =>
      new FrameStream((query, signal) => fetch("frames", query, signal), ...callbacks);
  const firstPart = agents && steps
    ? {
      first: 0,
      last: Math.min(steps, Math.max(MIN_PART_STEPS, Math.floor(PART_AGENT_STEPS / agents))),
    }
    : null;
  const fetchPart = async (part, signal) =>
    new Recording(await fetch("recording", part ?? firstPart, signal));
  return (...callbacks) => new Lifetime(fetchPart, ...callbacks);
}
