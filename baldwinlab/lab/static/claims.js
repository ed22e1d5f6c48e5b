/** The paper's claims: the verdict, the measured effect beside the paper's figure, and the lifetimes to look at. */

import { el, format } from "./common.js";

const TONES = { holds: "good", "does not hold": "warm" };
const MEASURES = { best: "best agent", mean: "average agent", share: "share that eats", most: "most that any agent ate" };

/**
 * @param {object[]} claims records of claims.json
 * @param {{id: string}} study
 * @param {(condition: string) => number} typicalRun
 * @param {(condition: string) => number} lastGeneration
 */
export function claimList(claims, study, typicalRun, lastGeneration) {
  const section = el("section", { class: "card", "data-testid": "claims" }, el("h2", {}, "The paper's claims"));
  if (!claims.length) {
    section.append(el("p", { class: "soft" }, "This study has not been held against the paper. ", el("code", {}, "baldwinlab report"), " does it."));
    return section;
  }
  section.append(el("p", { class: "soft" }, counted(claims)));
  for (const claim of claims) {
    const places = [claim.condition, claim.comparison].filter((name) => typicalRun(name) !== undefined);
    section.append(claimEntry(claim, places.map((name) => watchLink(study, name, typicalRun(name), lastGeneration(name)))));
  }
  return section;
}

function counted(claims) {
  const verdicts = [...new Set(claims.map((claim) => claim.verdict))];
  return `${verdicts.map((verdict) => `${claims.filter((claim) => claim.verdict === verdict).length} ${verdict}`).join(", ")}.`;
}

function claimEntry(claim, links) {
  return el("article", { class: "claim", "data-testid": `claim-${claim.id}` },
    el("div", { class: "claim-head" }, el("span", { class: `badge ${TONES[claim.verdict] ?? ""}` }, claim.verdict), el("p", {}, `${claim.id}. ${claim.claim}`)),
    el("dl", { class: "claim-facts" },
      ...fact("Measured", measured(claim)),
      ...fact("The paper", claim.paper),
      ...(links.length ? fact("Watch", ...links) : [])));
}

function fact(name, ...values) {
  return [el("dt", {}, name), el("dd", {}, ...values)];
}

function measured(claim) {
  if (claim.effect === null) return `not evaluated: there is no run of ${claim.missing.join(", ")}`;
  const against = claim.p === null ? claim.condition : `${claim.condition} less ${claim.comparison}`;
  const sign = claim.p !== null && claim.effect > 0 ? "+" : "";
  const interval = claim.interval ? ` (95 % interval ${claim.interval.map(format).join(" to ")})` : "";
  const p = claim.p_holm === null ? "" : `, corrected p ${claim.p_holm < 0.001 ? "below 0.001" : claim.p_holm.toFixed(3)}`;
  return `${sign}${format(claim.effect)}${interval}${p}; ${MEASURES[claim.measure] ?? claim.measure}, ${against}`;
}

function watchLink(study, condition, run, generation) {
  const life = { study: study.id, condition, run, generation };
  return el("a", { class: "claim-link", href: `#/world?${new URLSearchParams(life)}` }, condition);
}
