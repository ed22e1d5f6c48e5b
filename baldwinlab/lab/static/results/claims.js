/** The claims: verdict, measured effect, the value in the paper, and links to lifetimes. */

import { createCommandHint, createFold, el, formatNumber } from "../core/common.js";
import { findLastLifetime } from "./results_runs.js";

// The tone, and the singular and plural forms of the count.
export const VERDICTS = {
  holds: ["good", "holds", "hold"],
  undecided: ["", "is undecided", "are undecided"],
  "does not hold": ["warm", "does not hold", "do not hold"],
  "not evaluated": ["", "is not evaluated", "are not evaluated"],
};

/**
 * Return the section of the claims, or "" for a study without a paper and without claims.
 * @param {import("./view_results.js").ResultsState} view
 */
export function createClaimList(view) {
  const { study } = view;
  const { claims, problem, claim_measures: measures = {}, typical_run: typicalRuns } = view.results;
  const title = hasPaperClaims(claims) ? "The paper's claims" : "The claims";
  const section = createFold("claims", title, Boolean(problem));
  if (problem) {
    section.append(el("p", { role: "alert", "data-testid": "claims-problem" }, problem));
    return section;
  }
  if (!claims.length) {
    if (!study.paper) return "";
    const hint = "The claims of this study have not been evaluated yet.";
    section.append(createCommandHint(hint, `baldwinlab report ${study.argument}`));
    return section;
  }
  const changes = claims[0].changes ?? [];
  if (changes.length)
    section.append(
      el(
        "p",
        { role: "note", "data-testid": "claims-changes" },
        el("strong", {}, `Changed model: ${changes.join(", ")}.`),
        " These verdicts do not apply to the model of the paper.",
      ),
    );
  section.append(el("p", { class: "soft" }, countVerdicts(claims)));
  for (const claim of claims) {
    const lifetimes = [claim.condition, claim.comparison]
      .filter((name) => typicalRuns[name] !== undefined)
      .map((name) => findLastLifetime(view, name, typicalRuns[name]));
    section.append(createClaimEntry(claim, measures[claim.measure] ?? claim.measure, lifetimes));
  }
  return section;
}

/** Return whether any claim is from a paper. Custom claims are not. */
function hasPaperClaims(claims) {
  return !claims.length || claims.some((claim) => claim.paper || (claim.figure ?? null) !== null);
}

/** Return the number of claims by verdict, without exploratory claims. */
function countVerdicts(claims) {
  const counted = claims.filter(({ kind }) => kind !== "exploratory");
  const exploratory = claims.length - counted.length;
  const counts = Object.entries(VERDICTS).map(([verdict, labels]) => [
    counted.filter((claim) => claim.verdict === verdict).length,
    labels,
  ]);
  if (exploratory)
    counts.push([exploratory, [
      "",
      "is exploratory and not counted",
      "are exploratory and not counted",
    ]]);
  return `${
    counts
      .filter(([count]) => count)
      .map(([count, [, singular, plural]]) => `${count} ${count === 1 ? singular : plural}`)
      .join(", ")
  }.`;
}

/**
 * @param {object} claim
 * @param {string} measure its name
 * @param {any} lifetimes that the entry links to, at most two
 */
function createClaimEntry(claim, measure, lifetimes) {
  return el(
    "article",
    { class: "claim", "data-testid": `claim-${claim.id}` },
    el(
      "div",
      { class: "claim-head" },
      el(
        "span",
        { class: `badge ${VERDICTS[claim.verdict]?.[0] ?? ""}` },
        claim.too_few_runs ? "too few runs" : claim.verdict,
      ),
      ...(claim.unstable ? [el("span", { class: "badge" }, "unstable")] : []),
      el("p", {}, `${claim.id}. ${claim.claim}`),
    ),
    el(
      "dl",
      { class: "claim-facts" },
      ...createFactRows("Measured", describeEffect(claim, measure)),
      ...(claim.paper ? createFactRows("The paper", claim.paper) : []),
      ...(lifetimes.length ? createFactRows("Watch", createWatchLink(lifetimes)) : []),
    ),
  );
}

function createFactRows(name, ...values) {
  return [el("dt", {}, name), el("dd", {}, ...values)];
}

function describeEffect(claim, measure) {
  if (claim.effect === null)
    return `not evaluated: ${claim.why_not ?? `no run of ${claim.missing.join(", ")}`}`;
  const comparison = claim.p === null
    ? claim.condition
    : `${claim.condition} minus ${claim.comparison}`;
  const sign = claim.p !== null && claim.effect > 0 ? "+" : "";
  const interval = claim.interval
    ? ` (95 % interval ${claim.interval.map(formatNumber).join(" to ")})`
    : "";
  const pValue = claim.p_holm < 0.001 ? "below 0.001" : claim.p_holm?.toFixed(3);
  const p = claim.p_holm === null ? "" : `, corrected p ${pValue}`;
  const weakest = claim.comparisons.length > 1
    ? `; the weakest of ${claim.comparisons.length} comparisons`
    : "";
  return (
    `${sign}${formatNumber(claim.effect)}${interval}${p}; ` +
    `${measure}, ${comparison}${weakest}` +
    (claim.note ? `; ${claim.note}` : "")
  );
}

/** Return the link to one lifetime, or to two lifetimes for comparison. */
function createWatchLink([life, reference]) {
  const second = reference
    ? Object.entries(reference).map(([key, value]) => [`b.${key}`, value])
    : [];
  const address = `#/world?${new URLSearchParams([...Object.entries(life), ...second])}`;
  return el(
    "a",
    { href: address },
    reference ? `${life.condition} and ${reference.condition}` : life.condition,
  );
}
