// Active contingencies and their responses, the most urgent first; then flags that no row has taken up yet, and hazards that the table
// leaves unanswered on purpose.

import { attribute, disabledFor, h, list, part, text } from "./dom.js";
import { has, inCommand, isCutOff, store } from "./store.js";
import { age, flag, sentence } from "./words.js";
import { alarmOf } from "./alarms.js";
import { order } from "./orders.js";

export function mountContingencies() {
  const panel = document.getElementById("contingencies");
  const body = panel.querySelector(".body");
  const cards = h("ul", { class: "cards", "aria-live": "polite" });
  const none = h("p", { class: "empty" }, "None.");
  const waivers = h("ul", {});
  const waived = h("details", { class: "muted", id: "waivers" }, h("summary", {}, "Hazards without an answer, by the table"), waivers);
  body.append(none, cards, waived);
  return () => {
    const reasons = store.session?.waivers ?? [];
    attribute(waived, "hidden", !reasons.length);
    list(waivers, reasons, (it) => `${it.hazard} ${it.phases}`, () => h("li", {}), (line, it) => text(line, `${it.hazard} (${it.phases.join(", ")}): ${it.reason}`));
    const items = itemsOf(store.doc);
    attribute(none, "hidden", items.length > 0);
    text(none, !store.doc ? "" : store.doc.contingencies ? "None." : "Not known yet: the mission manager was not heard.");
    const open = items.filter((it) => it.active && !it.acknowledgedBy).map((it) => alarmOf(it.alarm));
    attribute(panel, "data-alarm", open.length ? open.reduce((a, b) => (a.rank < b.rank ? b : a)).tone : null);
    list(cards, items, (it) => it.flag, make, fill);
  };
}

function itemsOf(doc) {
  const active = doc?.contingencies?.active ?? [];
  const flags = doc?.flags ?? [];
  const taken = active.map((it) => ({ ...it, active: true, acts: doc.contingencies.acting === it.flag }));
  const others = flags
    .filter((it) => !active.some((row) => row.flag === it.name))
    .map((it) => ({ flag: it.name, priority: Infinity, sinceS: it.sinceS, reason: it.reason }));
  return [...taken.sort((a, b) => a.priority - b.priority), ...others];
}

function make(it) {
  const acknowledge = () => order(store.selected, `acknowledge ${flag(it.flag)}`, `contingencies/${encodeURIComponent(it.flag)}/acknowledge`);
  return h(
    "li",
    { class: "card", "data-flag": it.flag },
    h("div", { class: "card-head" }, h("span", { class: "form", "data-part": "form" }), h("strong", {}, flag(it.flag)), h("span", { class: "badge", "data-part": "state" }), h("span", { class: "figure muted", "data-part": "since" })),
    h("p", { class: "reason", "data-part": "reason" }),
    h("div", { class: "buttons" }, h("button", { "data-part": "acknowledge", "aria-label": `Acknowledge ${flag(it.flag)}`, click: acknowledge }, "Acknowledge"), h("span", { class: "muted", "data-part": "by" })),
  );
}

function fill(card, it) {
  const state = part(card, "state");
  const doing = it.action ? `: ${flag(it.action)}` : "";
  text(state, it.acts ? `acting${doing}` : it.active ? `waiting${doing}` : "flag up");
  // A flag that no row has taken up yet has no class.
  const alarm = it.active ? alarmOf(it.alarm) : { tone: "none", form: "○", word: "" };
  attribute(state, "data-tone", alarm.tone);
  attribute(card, "data-tone", alarm.tone);
  text(part(card, "form"), alarm.form);
  attribute(part(card, "form"), "title", alarm.word);
  text(part(card, "since"), `for ${age(it.sinceS)}`);
  text(part(card, "reason"), sentence(it.reason));
  const button = part(card, "acknowledge");
  const may = has("safety") || has("operator");
  attribute(button, "hidden", !it.active || Boolean(it.acknowledgedBy) || !may);
  disabledFor(button, isCutOff() ? "not connected" : has("safety") || inCommand() ? "" : "take command first");
  text(part(card, "by"), it.acknowledgedBy ? `Acknowledged by ${it.acknowledgedBy}` : "");
  attribute(card, "data-acknowledged", it.acknowledgedBy ? "true" : null);
}
