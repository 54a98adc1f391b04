// Decisions and events as sentences, and as marks along the mission time.

import { attribute, h, list, part, text, fit, theme } from "./dom.js";
import { store } from "./store.js";
import { clock, flag, name, objective, outcome, permission, sentence } from "./words.js";

const TOPICS = ["plan", "step", "permission", "contingency", "mission", "operator"];
const SHOWN = 400;

const hidden = new Set();

export function mountTimeline() {
  const body = document.querySelector("#timeline .body");
  const chips = h("div", { class: "chips", role: "group", "aria-label": "Topics shown" }, ...TOPICS.map(chip));
  const search = h("input", { type: "search", id: "journal-search", placeholder: "Filter: battery, area A, anna…", "aria-label": "Show only lines with these words", autocomplete: "off" });
  const canvas = h("canvas", { class: "marks", role: "img", "aria-label": "Events along the mission time" });
  const rows = h("ol", { class: "log", tabindex: "0", "aria-label": "Decisions, newest first" });
  body.append(chips, search, canvas, rows);
  canvas.addEventListener("click", (event) => jump(canvas, rows, event.offsetX));
  canvas.title = "Click to go to a moment";
  let drawn = "";
  return () => {
    const latest = store.events.at(-1);
    const wanted = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const state = [store.selected, store.events.length, latest?.id, [...hidden].join(), wanted.join(" "), canvas.clientWidth, document.documentElement.dataset.theme, Math.floor(store.doc?.missionTimeS ?? 0)].join();
    if (state === drawn) return;
    drawn = state;
    const told = toldByDecisions(store.events);
    const raised = new Map([...told].filter((it) => it.type === "decision").map((it) => [it.data.sequence, it]));
    const has = (it) => wanted.every((word) => `${it.topic} ${it.words}`.toLowerCase().includes(word));
    const lines = store.events.filter((it) => !told.has(it)).map((it, index) => line(it, index, raised.get(it.data.parent))).filter((it) => it && !hidden.has(it.topic) && has(it));
    list(rows, lines.slice(-SHOWN).reverse(), (it) => it.key, make, fill);
    draw(canvas, lines);
  };
}

function chip(topic) {
  const toggle = () => {
    hidden.has(topic) ? hidden.delete(topic) : hidden.add(topic);
    attribute(button, "aria-pressed", String(!hidden.has(topic)));
  };
  const button = h("button", { class: "chip", "data-topic": topic, "aria-pressed": "true", click: toggle }, topic);
  return button;
}

/** Mission seconds within which an event and a decision are about the same. */
const SAME_S = 3;

/**
 * Events that have no line of their own: a flag that the mission manager has taken up, that it was raised where the answer to it follows at
 * once and says it first, and an order that it has accepted.
 */
function toldByDecisions(events) {
  const told = new Set();
  const decisions = events.filter((it) => it.type === "decision");
  const answers = new Map(decisions.filter((it) => it.data.kind === "DECISION_KIND_CONTINGENCY_ANSWERED").map((it) => [it.data.parent, it]));
  const near = (a, b) => Math.abs((a.at ?? 0) - (b.at ?? 0)) <= SAME_S;
  for (const it of events) {
    const { type, data } = it;
    const kinds = type === "flag" ? [data.raised ? "DECISION_KIND_CONTINGENCY_RAISED" : "DECISION_KIND_CONTINGENCY_CLEARED"] : ["DECISION_KIND_ORDER_ACCEPTED", "DECISION_KIND_ORDER_REFUSED"];
    const repeats = (by) => kinds.includes(by.data.kind) && near(by, it) && (type === "flag" ? by.data.flag === data.name : by.data.text?.includes(data.who));
    const raised = type === "decision" && data.kind === "DECISION_KIND_CONTINGENCY_RAISED" && answers.get(data.sequence);
    if ((raised && near(raised, it)) || (["flag", "audit"].includes(type) && decisions.some(repeats))) told.add(it);
  }
  return told;
}

/** An event as a line; an event that is not for people is left out. `raised`: that the flag which it answers was raised, to be said first. */
function line({ id, type, data, at }, index, raised) {
  const key = id ?? `${type}-${at}-${index}`;
  const as = (topic, words, tone) => ({ key, at, topic, words: sentence(words), tone });
  switch (type) {
    case "decision":
      return as(data.topic, raised && data.kind === "DECISION_KIND_CONTINGENCY_ANSWERED" ? `${raised.data.sentence} ${data.sentence}` : data.sentence, /fail|denied|revoked/.test(data.text) ? "bad" : null);
    case "flag":
      return as("contingency", `${flag(data.name)} ${data.raised ? "raised" : "cleared"}${data.reason ? `: ${data.reason}` : ""}`, data.raised ? "bad" : null);
    case "permission": {
      // Decisions of the mission manager report grants; only this event reports a permission that is lost later.
      const lost = ["PERMISSION_STATE_REVOKED", "PERMISSION_STATE_EXPIRED"].includes(data.state);
      return lost ? as("permission", `area ${data.area} is ${permission(data.state)}${data.reason ? `: ${data.reason}` : ""}`, "warn") : null;
    }
    case "objective":
      return data.state === "OBJECTIVE_STATE_WAITING" ? null : as("mission", `objective ${data.name}: ${objective(data.state)}${data.reason ? `: ${data.reason}` : ""}`, data.state.endsWith("FAILURE") ? "bad" : "good");
    case "report":
      return as("mission", `mission over: ${outcome(data.outcome)}${data.reason ? `, ${data.reason}` : ""}`, data.outcome.endsWith("SUCCESS") ? "good" : "bad");
    case "audit":
      return as("operator", `${data.who}: ${ordered(data)}`, data.status >= 400 ? "warn" : null);
    default:
      return null;
  }
}

function make() {
  return h("li", {}, h("time", { class: "figure", "data-part": "at" }), h("span", { class: "topic", "data-part": "topic" }), h("span", { "data-part": "words" }));
}

function fill(row, it) {
  text(part(row, "at"), clock(it.at));
  text(part(row, "topic"), it.topic);
  text(part(row, "words"), it.words);
  attribute(row, "data-topic", it.topic);
  attribute(row, "data-tone", it.tone);
  row.dataset.at = it.at;
}

const LANES = { plan: 0, step: 1, permission: 2, contingency: 3, mission: 4, operator: 5 };

function span() {
  return Math.max(30, store.doc?.missionTimeS ?? 0, store.events.at(-1)?.at ?? 0);
}

function draw(canvas, lines) {
  const { context, width, height } = fit(canvas);
  const colour = theme();
  const lane = height / TOPICS.length;
  context.strokeStyle = colour("line");
  context.lineWidth = 1;
  for (let n = 0; n <= TOPICS.length; n++) {
    context.beginPath();
    context.moveTo(0, Math.round(n * lane) + 0.5);
    context.lineTo(width, Math.round(n * lane) + 0.5);
    context.stroke();
  }
  for (const it of lines) {
    context.fillStyle = colour(it.tone ?? `topic-${it.topic}`);
    const x = (it.at / span()) * (width - 4);
    context.fillRect(x, (LANES[it.topic] ?? 4) * lane + 1.5, 3, lane - 2);
  }
}

function jump(canvas, rows, x) {
  const at = (x / canvas.clientWidth) * span();
  const nearest = [...rows.children].reduce((best, it) => (best && Math.abs(best.dataset.at - at) <= Math.abs(it.dataset.at - at) ? best : it), null);
  nearest?.scrollIntoView({ block: "center" });
  for (const it of rows.children) it.classList.toggle("found", it === nearest);
}

/** An order and its outcome. The outcome of an order about one thing, such as `permissions/A/decision`, names the thing itself. */
function ordered({ what, outcome, status }) {
  const order = what.replace(/^(command|simulation)\//, "");
  return outcome && order.includes("/") ? outcome : `${order.replaceAll("/", " ")}, ${outcome || name(String(status), "")}`;
}
