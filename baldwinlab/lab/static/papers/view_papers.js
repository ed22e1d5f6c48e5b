/** The Papers tab: one card per paper, with its studies and commands. */

import { VERDICTS } from "../results/claims.js";
import {
  createButton,
  createIcon,
  el,
  formatNumber,
  getJSON,
  showMessage,
} from "../core/common.js";

const COPY_ICON = "M7 7V3h10v10h-4M3 7h10v10H3z";

/**
 * Mount the view (see main.js). The address can name a `paper`, whose card is open.
 */
export function mount(root, state, _navigate, guide) {
  const lead = el(
    "div",
    { class: "lead" },
    el("h1", {}, "Papers to reproduce"),
    guide.createDefinitionLink(),
  );
  const page = el("div", { class: "page papers", "data-testid": "papers" }, lead);
  const aborted = new AbortController();
  root.append(page);
  const cards = el("ul", { class: "paper-cards" });
  page.append(cards);
  const show = async ({ paper }) => {
    const { papers, problem } = await getJSON(
      `api/papers?${new URLSearchParams(paper ? { paper } : {})}`,
      aborted.signal,
    );
    cards.replaceChildren(...papers.map(createCard));
    if (problem) showMessage(problem, "error");
    /** @type {NodeListOf<HTMLElement>} */
    const items = cards.querySelectorAll("[data-paper]");
    const target = [...items].find(({ dataset }) => dataset.paper === paper);
    if (!target) return;
    target.querySelector("details").open = true;
    target.scrollIntoView({ block: "start" });
    target.focus({ preventScroll: true });
  };
  const update = (next) =>
    show(next).catch((error) => aborted.signal.aborted || showMessage(error.message, "error"));
  update(state);
  return { update, unmount: () => aborted.abort() };
}

/** Return a card. It is closed at first, and shows a picture, the question and the verdicts. */
function createCard(paper) {
  const { name, title, card } = paper;
  const summary = el(
    "summary",
    { "data-testid": `open-${name}` },
    createPicture(paper),
    el("h2", {}, card?.question ?? title),
    createCount(paper),
  );
  return el(
    "li",
    { class: "card paper-card", "data-paper": name, tabindex: -1, "data-testid": `paper-${name}` },
    el("details", {}, summary, createDetails(paper)),
  );
}

/** Return the number of claims that hold in the first study of the unchanged model, or "". */
function createCount({ studies }) {
  const study = studies.find(({ changes, verdicts }) =>
    !changes.length && Object.keys(verdicts).length
  );
  if (!study) return "";
  const counts = Object.values(study.verdicts).flatMap(Object.entries);
  const sum = (entries) => entries.reduce((total, [, count]) => total + count, 0);
  const holding = sum(counts.filter(([verdict]) => verdict === "holds"));
  const text = `${holding}/${sum(counts)} hold`;
  return el("span", { class: "badge", title: "Claims that hold, of all claims" }, text);
}

function createPicture({ name, picture }) {
  if (!picture) return "";
  return el("img", {
    src: `api/papers/picture?${new URLSearchParams({ paper: name })}`,
    alt: "",
    width: 640,
    height: 320,
    loading: "lazy",
  });
}

function createDetails(paper) {
  const { title, authors, year, published, description, link, card } = paper;
  // The link of a third-party paper may be a script.
  const isAddress = /^https?:\/\//i.test(link);
  const source = [`${authors.join(", ")}, ${year}`, published].filter(Boolean).join(" · ");
  return el(
    "div",
    { class: "paper-details" },
    el("h3", {}, title),
    el(
      "p",
      { class: "soft" },
      source,
      ...(isAddress
        ? [" · ", el("a", { href: link, target: "_blank", rel: "noopener" }, "the paper")]
        : []),
    ),
    el("p", { class: "paper-summary" }, capitalize(description), "."),
    el("p", { class: "soft" }, describeSize(paper)),
    card ? createActivities(card) : "",
    ...paper.studies.map(createStudyRow),
    el("div", { class: "paper-run" }, ...createRunLinks(paper)),
  );
}

/** Return what to notice, to try and to extend. */
function createActivities({ notice, try: exercise, extend }) {
  const changes = Object.keys(exercise.changes).length
    ? { set: JSON.stringify(exercise.changes) }
    : {};
  const address = `#/live?${new URLSearchParams({ preset: exercise.preset, ...changes })}`;
  const start = el("a", { href: address, "data-testid": "exercise" }, "Open this live run");
  const rows = { Notice: [notice], Try: [exercise.text, " ", start], Extend: [extend] };
  return el(
    "dl",
    { class: "paper-activities" },
    ...Object.entries(rows).flatMap(([term, content]) => [
      el("dt", {}, term),
      el("dd", {}, ...content),
    ]),
  );
}

function describeSize({ conditions, claims, runs }) {
  const formatCount = (count, noun) => `${formatNumber(count)} ${noun}${count === 1 ? "" : "s"}`;
  return (
    `${formatCount(conditions, "condition")}, ${formatCount(runs, "run")} each, ` +
    `${claims ? formatCount(claims, "claim") : "no claims"}`
  );
}

/** Return the row of a study: changes of the model, verdicts and links. */
function createStudyRow({ study, argument, changes, verdicts, problem, is_viewable: isViewable }) {
  const name = study === "." ? "this study" : study;
  const createLink = (view, text) =>
    el(
      "a",
      { href: `#/${view}?${new URLSearchParams({ study })}`, "aria-label": `${text}: ${name}` },
      text,
    );
  const changesNote = el(
    "strong",
    { "data-testid": `changes-${study}` },
    `changed model: ${changes.join(", ")}`,
  );
  return el(
    "div",
    { class: "row paper-study", "data-testid": `study-${study}` },
    el("span", { class: "mono" }, name),
    ...(changes.length ? [changesNote] : []),
    ...createBadges(verdicts, problem, argument),
    el(
      "span",
      { class: "spread paper-links" },
      isViewable && createLink("world", "Watch"),
      createLink("results", "Results"),
    ),
  );
}

/** Return the badges of each kind of claims. Without verdicts, return the reason. */
function createBadges(verdicts, problem, argument) {
  const kinds = Object.entries(verdicts);
  if (kinds.length)
    return kinds.flatMap(([kind, counts]) => [
      ...(kind ? [el("span", { class: "soft" }, `${kind}:`)] : []),
      ...Object.entries(counts).map(([verdict, count]) => {
        const [tone, singular, plural] = VERDICTS[verdict];
        const verb = count === 1 ? singular : plural;
        return el("span", { class: `badge ${tone}` }, `${count} ${verb}`);
      }),
    ]);
  const reason = problem
    ? `The report is not valid. Run baldwinlab report ${argument}.`
    : "no report yet";
  return [el("span", { class: "soft", title: problem ?? "" }, reason)];
}

/** Return the buttons that run one condition or copy the command of the complete paper. */
function createRunLinks({ name, title, preset, live_runs: runs }) {
  const command = `baldwinlab reproduce ${name}`;
  const live = preset &&
    el(
      "a",
      {
        class: "button primary",
        href: `#/live?${new URLSearchParams({ preset, runs })}`,
        "aria-label": `Run live: ${title}`,
      },
      "Run live",
    );
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(command);
      showMessage(`Copied: ${command}`, "done");
    } catch {
      showMessage(`The browser does not allow copying. The command is: ${command}`, "error");
    }
  };
  return [
    live ?? "",
    createButton([createIcon(COPY_ICON), el("code", {}, command)], copy, {
      class: "quiet",
      title: "Copy the command that runs the complete paper",
      "data-testid": `copy-${name}`,
    }),
  ];
}

function capitalize(text) {
  return text[0].toUpperCase() + text.slice(1);
}
