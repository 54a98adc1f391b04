// The mission: its objectives, and the plan of the current one with action and communication side by side.

import { attribute, disabledFor, h, list, part, text } from "./dom.js";
import { has, store } from "./store.js";
import { capital, number, permission, sentence } from "./words.js";
import { objectives } from "./objectives.js";
import { insertForm } from "./insert.js";
import { feedLines } from "./feeds.js";
import { edit } from "./editor.js";

export function mountMission() {
  const body = document.querySelector("#mission .body");
  const all = objectives();
  const insert = insertForm();
  const feeds = feedLines();
  const editing = h("button", { id: "mission-edit", "aria-pressed": "false", "data-help": "Change the objectives, or try out another mission", click: () => edit(!store.editing) }, "Edit mission");
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
  body.append(all.element, insert.element, h("div", { class: "buttons" }, editing), hold, report, feeds.element, heading, table);
  return () => {
    const doc = store.doc;
    all.fill();
    insert.fill();
    feeds.fill();
    attribute(editing, "hidden", !doc || !has("operator"));
    attribute(editing, "aria-pressed", String(store.editing));
    disabledFor(editing, doc?.report && doc.aircraft?.derived?.flying && !store.editing ? "the mission is over: land first" : "");
    attribute(hold, "hidden", !doc?.mission?.hold);
    text(hold, doc?.mission?.hold ? `Holding: ${sentence(doc.mission.hold)}` : "");
    attribute(report, "hidden", !doc?.report);
    text(report, doc?.report ? summary(doc.report) : "");
    const planned = store.plan.steps.length > 0 && !doc?.report;
    attribute(table, "hidden", !planned);
    attribute(heading, "hidden", !planned);
    text(heading, `Plan ${store.plan.revision ?? ""}`);
    const first = firstNumber();
    list(steps, store.plan.steps.map((it, index) => ({ ...it, number: first + index })), (it) => `${store.plan.revision}-${it.step.id}`, makeStep, fillStep);
  };
}

/** The number of the first step that is known, as the decisions count: a page that is opened late does not know those before it. */
function firstNumber() {
  const current = store.doc?.plan?.current;
  const present = store.plan.steps.findIndex((it) => it.step.id === current?.stepId);
  return present < 0 || !current.stepNumber ? 1 : Math.max(1, current.stepNumber - present);
}

function summary(report) {
  const done = report.objectives.filter((it) => it.state === "OBJECTIVE_STATE_SUCCESS").length;
  const reason = report.reason ? ` ${sentence(report.reason)}` : "";
  return `Mission over after ${number(report.durationS)} s: ${done} of ${report.objectives.length} objectives achieved.${reason}`;
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
  text(part(row, "number"), done ? "✓" : String(it.number));
  text(part(row, "action"), capital(it.step.text));
  const bar = part(row, "bar");
  attribute(bar, "hidden", !present);
  const left = current?.distanceLeftM ?? 0;
  if (present) bar.value = store.plan.longest > 0 ? 1 - left / store.plan.longest : 0;
  text(part(row, "left"), present ? (current.inTransition ? "transition action flies" : `${number(left)} m left`) : "");
  const states = new Map((store.doc?.permissions ?? []).map((p) => [p.area, p.state]));
  const asked = it.ask.map((ask) => `${ask.area}: ${permission(states.get(ask.area))}`);
  const ahead = it.ahead.map((ask) => `${ask.area} ahead: ${permission(states.get(ask.area))}`);
  text(part(row, "ask"), [...asked, ...ahead].join(", ") || "–");
  attribute(row, "data-state", present ? "present" : done ? "done" : "ahead");
  attribute(row, "aria-current", present ? "step" : null);
}
