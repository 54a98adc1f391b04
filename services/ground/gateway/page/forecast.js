// What a mission would need, as the planner answered: a table, or the mistakes in its text.

import { h } from "./dom.js";
import { capital, clock, number, sentence } from "./words.js";

/** The planner's answer, and a row for each objective with its plan to unfold. */
export function forecast(words, tone, items) {
  const rows = items.flatMap((it) => [row(it), plan(it)]).filter(Boolean);
  const heads = ["", "Objective", "Distance", "Time", "Energy", "Battery there", "Permissions"].map((it) => h("th", { scope: "col" }, it));
  return h("div", {},
    h("p", { class: "said", "data-tone": tone }, sentence(words)),
    items.length ? h("table", { class: "forecast" }, h("thead", {}, h("tr", {}, ...heads)), h("tbody", {}, ...rows, total(items))) : null,
  );
}

function row(it) {
  return h("tr", { "data-objective": it.objective, "data-tone": it.reachable ? "good" : "bad" },
    h("td", { class: "glyph" }, it.reachable ? "✓" : "✕"),
    h("td", {}, h("strong", {}, it.objective), it.reason ? h("span", { class: "reason" }, sentence(it.reason)) : null),
    h("td", { class: "figure" }, `${number(it.lengthM)} m`),
    h("td", { class: "figure" }, clock(it.flightTimeS)),
    h("td", { class: "figure" }, `${number(it.energyWh)} Wh`),
    h("td", { class: "figure" }, chargeAt(it)),
    h("td", {}, it.permissions?.join(", ") || "–"),
  );
}

/** The charge of the battery when the objective is reached. */
function chargeAt(it) {
  const charge = it.legs?.at(-1)?.charge;
  return charge == null ? "–" : `${number(charge * 100)} %`;
}

function plan(it) {
  const steps = it.plan?.steps ?? [];
  if (!steps.length) return null;
  const line = (step) => h("li", {}, capital(step.text));
  const folded = h("details", {}, h("summary", {}, steps.length === 1 ? "1 step" : `${steps.length} steps`), h("ol", { class: "proposed" }, ...steps.map(line)));
  return h("tr", { class: "unfolds" }, h("td", {}), h("td", { colspan: 6 }, folded));
}

function total(items) {
  const sum = (key) => items.reduce((all, it) => all + (it[key] ?? 0), 0);
  return h("tr", { class: "total" },
    h("td", {}),
    h("td", {}, "Total, without waits"),
    h("td", { class: "figure" }, `${number(sum("lengthM"))} m`),
    h("td", { class: "figure" }, clock(sum("flightTimeS"))),
    h("td", { class: "figure" }, `${number(sum("energyWh"))} Wh`),
    h("td", {}),
    h("td", {}),
  );
}

/** Each mistake, with a button that leads to its line. */
export function mistakes(lines, area) {
  return h("ul", { class: "mistakes" }, ...lines.map((it) => {
    const [first, ...rest] = it.split("\n");
    const [, line, column] = /^[^:\n]*:(\d+):(\d+)/.exec(first) ?? [];
    const go = line ? h("button", { class: "chip", click: () => goTo(area, Number(line), Number(column)) }, `line ${line}`) : null;
    return h("li", {}, go, h("span", { class: "reason" }, first.replace(/^[^:\n]*:(\d+):(\d+): /, "")), rest.length ? h("pre", {}, rest.join("\n")) : null);
  }));
}

function goTo(area, line, column) {
  const lines = area.value.split("\n");
  const at = lines.slice(0, line - 1).reduce((all, it) => all + it.length + 1, 0) + column - 1;
  area.focus();
  area.setSelectionRange(at, at + 1);
  area.scrollTop = ((line - 3) / lines.length) * area.scrollHeight;
}
