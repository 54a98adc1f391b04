// What calls for a human, by the class of its alarm: the bar on top, the tab's title, the sound, and a notification.

import { command, newKey, Refusal } from "./api.js";
import { attribute, h, list, part, text } from "./dom.js";
import { announce } from "./orders.js";
import { changed, has, isCutOff, select, store } from "./store.js";
import { firstAction, responseWords } from "./response.js";
import { clock, flag } from "./words.js";
import { mountNotices } from "./notices.js";
import { isShelved, shelve, shelvedUntil, unshelveAll } from "./shelf.js";

/** Each class with its rank, tone, form and the number of beeps; an advisory makes no noise and is not an alarm. */
const CLASSES = {
  ALARM_WARNING: { rank: 3, tone: "bad", form: "▲", word: "warning", beeps: 3 },
  ALARM_CAUTION: { rank: 2, tone: "warn", form: "◆", word: "caution", beeps: 1 },
  ALARM_ADVISORY: { rank: 1, tone: "accent", form: "●", word: "advisory", beeps: 0 },
};
/** A decision that takes its default if nobody decides in time. */
const DECISION = { rank: 2, tone: "warn", form: "◇", word: "decision", beeps: 1 };
const TITLE = document.title;
/** Minutes for which an alarm can be shelved. */
const SHELVES = [5, 15, 60];

/** The class of a contingency; one that a vehicle of another version does not tell counts as a warning. */
export const alarmOf = (it) => CLASSES[it] ?? CLASSES.ALARM_WARNING;

export function mountAlarms() {
  const bar = document.getElementById("alarm");
  const rows = h("ul", { class: "alarms" });
  const all = h("button", { id: "acknowledge-all", click: () => acknowledgeAll() }, "Acknowledge all");
  const shelved = h("button", { id: "unshelve", click: unshelveAll, title: "Shows them again at once" });
  bar.append(rows, h("div", { class: "alarm-tools" }, all, shelved));
  const { sound, notify } = mountNotices();
  let known = new Set();
  let open = [];
  const acknowledgeAll = () => open.filter((it) => it.isFlag).forEach(acknowledge);
  return () => {
    const every = alarmsOfAll();
    open = every.filter((it) => !isShelved(it.key));
    const resting = every.length - open.length;
    attribute(bar, "hidden", !every.length);
    attribute(bar, "data-tone", open.length ? worst(open).tone : null);
    list(rows, open, (it) => it.key, make, fill);
    attribute(all, "hidden", open.filter((it) => it.isFlag).length < 2 || !mayAcknowledge());
    attribute(shelved, "hidden", !resting);
    text(shelved, `${resting} shelved until ${shelvedUntil(every.map((it) => it.key))}: show`);
    const first = open[0];
    const title = first ? `${open.length > 1 ? `(${open.length}) ` : ""}${first.form} ${first.vehicle}: ${flag(first.flag)} – ${TITLE}` : TITLE;
    if (document.title !== title) document.title = title;
    const fresh = open.filter((it) => !known.has(it.key));
    if (fresh.length) {
      sound(worst(fresh).beeps);
      notify(fresh.map(words));
    }
    known = new Set(open.map((it) => it.key));
  };
}

/** The loudest of them. */
const worst = (alarms) => alarms.reduce((a, b) => (a.rank < b.rank ? b : a));

const mayAcknowledge = () => has("safety") || has("operator");

/** Alarms that nobody has acknowledged, on any vehicle, the oldest first; then open decisions. */
function alarmsOfAll() {
  const selected = isCutOff() || !store.doc ? [] : alarmsOf({ ...store.doc, ...store.doc.contingencies, contingencies: store.doc.contingencies?.active });
  // The list shows the last state of an unreachable vehicle, with its age: here it would stand for ever.
  const others = store.vehicles.filter((it) => it.vehicle !== store.selected);
  const ofOther = (it) => (it.contact?.lost ? [silence(it)] : alarmsOf(it));
  return [...selected, ...others.flatMap(ofOther)].sort((a, b) => b.sinceS - a.sinceS);
}

/** A vehicle that is not heard; of the selected one a banner of its own tells that. */
function silence({ vehicle, contact }) {
  return { ...CLASSES.ALARM_WARNING, key: `${vehicle} contact`, vehicle, flag: "no_contact", sinceS: contact.wallAgeS, more: "" };
}

function alarmsOf({ vehicle, contingencies, acting, way, waitsFor }) {
  const open = (contingencies ?? []).filter((it) => !it.acknowledgedBy && 1 < alarmOf(it.alarm).rank);
  const flags = open.map((it) => {
    const response = acting === it.flag ? `, ${firstAction(it.action)}${way ? `: ${responseWords(way)}` : ""}` : "";
    return { ...alarmOf(it.alarm), key: `${vehicle} ${it.flag}`, vehicle, flag: it.flag, sinceS: it.sinceS, more: response, isFlag: true };
  });
  const decisions = (waitsFor ?? []).filter((it) => it.untilS != null);
  return [...decisions.map((it) => ({ ...DECISION, key: `${vehicle} waits for ${it.what}`, vehicle, flag: it.what, sinceS: 0, more: `, ${it.default} in ${clock(it.untilS)}` })), ...flags];
}

/** `▲ uav1 warning: battery low, return home. Home, down in 0:35.` */
function words({ form, word, vehicle, flag: name, more }) {
  return `${form} ${vehicle} ${word}: ${flag(name)}${more}.`;
}

function make(it) {
  const choose = h("select", { "data-part": "shelve", "aria-label": `Shelve ${flag(it.flag)} of ${it.vehicle}`, change: () => put() }, h("option", { value: "" }, "Shelve…"));
  for (const minutes of SHELVES) choose.append(h("option", { value: minutes }, `for ${minutes} min`));
  const put = () => {
    if (choose.value) shelve(it.key, Number(choose.value));
    choose.value = "";
    changed();
  };
  const show = () => {
    select(it.vehicle);
    document.getElementById(it.word === DECISION.word ? "commands" : "contingencies").scrollIntoView({ block: "nearest" });
  };
  return h(
    "li",
    { class: "alarm", "data-alarm-of": it.key },
    h("button", { class: "alarm-words", "data-part": "words", click: show }),
    h("span", { class: "figure muted", "data-part": "since" }),
    h("button", { "data-part": "acknowledge", "aria-label": `Acknowledge ${flag(it.flag)} of ${it.vehicle}`, click: () => acknowledge(it) }, "Acknowledge"),
    choose,
  );
}

function fill(row, it) {
  text(part(row, "words"), words(it));
  text(part(row, "since"), it.sinceS ? clock(it.sinceS) : "");
  attribute(row, "data-tone", it.tone);
  attribute(part(row, "acknowledge"), "hidden", !it.isFlag || !mayAcknowledge());
}

/** Whether this client may is decided by the gateway: of a vehicle that is not selected the page does not know who has command. */
async function acknowledge({ vehicle, flag: name }) {
  try {
    await command("POST", `/api/v1/vehicles/${encodeURIComponent(vehicle)}/contingencies/${encodeURIComponent(name)}/acknowledge`, undefined, newKey());
    announce("good", `${vehicle}: ${flag(name)} acknowledged`);
  } catch (refusal) {
    if (!(refusal instanceof Refusal)) throw refusal;
    announce("bad", `acknowledge ${flag(name)} of ${vehicle}: refused: ${refusal.message}`);
  }
}
