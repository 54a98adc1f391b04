// The objectives, and the plan of the present one: action and communication side by side.

import { attribute, h, list, part, text } from "./dom.js";
import { store } from "./store.js";
import { number, objective, permission, sentence, step } from "./words.js";

const GLYPHS = { SUCCESS: "✓", FAILURE: "✕", WAITING: "○" };
const TONES = { SUCCESS: "good", FAILURE: "bad" };

export function mountMission() {
  const body = document.querySelector("#mission .body");
  const objectives = h("ol", { class: "objectives" });
  const hold = h("p", { class: "note-line", "data-tone": "warn", hidden: true });
  const heading = h("h3", {});
  const steps = h("tbody", {});
  const table = h(
    "table",
    { class: "plan" },
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "#"), h("th", { scope: "col" }, "Action"), h("th", { scope: "col" }, "Communication"))),
    steps,
  );
  const report = h("div", { class: "report", id: "report", hidden: true });
  body.append(objectives, hold, report, heading, table);
  return () => {
    const doc = store.doc;
    const mission = doc?.mission;
    const rows = (mission?.objectives ?? []).map((it, index) => ({ ...it, index, present: index === mission.currentObjective }));
    list(objectives, rows, (it) => it.index, makeObjective, fillObjective);
    attribute(hold, "hidden", !mission?.hold);
    text(hold, mission?.hold ? `Holds: ${sentence(mission.hold)}` : "");
    attribute(report, "hidden", !doc?.report);
    text(report, doc?.report ? summary(doc.report) : "");
    attribute(table, "hidden", !store.plan.steps.length || Boolean(doc?.report));
    attribute(heading, "hidden", !store.plan.steps.length || Boolean(doc?.report));
    text(heading, `Plan ${store.plan.revision ?? ""}`);
    list(steps, store.plan.steps.map((it, index) => ({ ...it, index })), (it) => `${store.plan.revision}-${it.step.id}`, makeStep, fillStep);
  };
}

function summary(report) {
  const done = report.objectives.filter((it) => it.state === "OBJECTIVE_STATE_SUCCESS").length;
  const reason = report.reason ? ` ${sentence(report.reason)}` : "";
  return `Mission over after ${number(report.durationS)} s: ${done} of ${report.objectives.length} objectives achieved.${reason}`;
}

function makeObjective() {
  return h(
    "li",
    {},
    h("span", { class: "glyph", "data-part": "glyph", "aria-hidden": "true" }),
    h("div", {}, h("strong", { "data-part": "name" }), h("span", { class: "muted", "data-part": "place" }), h("span", { class: "reason", "data-part": "reason" })),
    h("span", { class: "muted", "data-part": "state" }),
  );
}

function fillObjective(row, it) {
  const key = it.state.replace("OBJECTIVE_STATE_", "");
  const { northM = 0, eastM = 0, downM = 0 } = it.position ?? {};
  text(part(row, "glyph"), it.present && key === "WAITING" ? "▸" : (GLYPHS[key] ?? "○"));
  text(part(row, "name"), it.name);
  const height = it.flying ? `, ${number(-downM)} m high` : ", on the ground";
  text(part(row, "place"), `N ${number(northM)}, E ${number(eastM)}${height}`);
  text(part(row, "state"), it.present && key === "WAITING" ? "present" : objective(it.state));
  text(part(row, "reason"), it.reason ? sentence(it.reason) : it.replans ? `Planned anew ${it.replans === 1 ? "once" : `${it.replans} times`}.` : "");
  attribute(row, "data-tone", TONES[key] ?? (it.present ? "accent" : null));
}

function makeStep() {
  return h(
    "tr",
    {},
    h("td", { class: "figure", "data-part": "number" }),
    h("td", {}, h("span", { "data-part": "action" }), h("span", { class: "muted", "data-part": "left" }), h("progress", { max: 1, "data-part": "bar", "aria-label": "Progress of the step" })),
    h("td", { "data-part": "ask" }),
  );
}

function fillStep(row, it) {
  const current = store.doc?.plan?.current;
  const present = it.step.id === current?.stepId;
  const done = store.plan.done.has(it.step.id);
  text(part(row, "number"), done ? "✓" : String(it.index + 1));
  text(part(row, "action"), step(it.step) + (it.step.auxiliary ? " (on the way)" : ""));
  const bar = part(row, "bar");
  attribute(bar, "hidden", !present);
  const left = current?.distanceLeftM ?? 0;
  if (present) bar.value = store.plan.longest > 0 ? 1 - left / store.plan.longest : 0;
  text(part(row, "left"), present ? (current.inTransition ? "transition flies meanwhile" : `${number(left)} m left`) : "");
  const states = new Map((store.doc?.permissions ?? []).map((p) => [p.area, p.state]));
  text(part(row, "ask"), it.ask.map((ask) => `${ask.area}: ${permission(states.get(ask.area))}`).join(", ") || "–");
  attribute(row, "data-state", present ? "present" : done ? "done" : "ahead");
  attribute(row, "aria-current", present ? "step" : null);
}
