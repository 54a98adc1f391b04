// The vehicles, those in trouble first.

import { alarmOf } from "./alarms.js";
import { attribute, h, list, part, text } from "./dom.js";
import { isCutOff, select, store } from "./store.js";
import { age, flag, number, outcome, phase } from "./words.js";

const FLEET_STALE_MS = 2500;
const SEVERITY = ["NOMINAL", "STARTING", "OVER", "ENDING", "REPLANNING", "CONTINGENCY"];

export function mountFleet() {
  const body = document.querySelector("#fleet .body");
  const items = h("ul", { class: "rows" });
  body.append(items);
  return () => {
    const stale = performance.now() - store.fleetAt > FLEET_STALE_MS;
    const sorted = [...store.vehicles].sort((a, b) => severity(b) - severity(a) || a.vehicle.localeCompare(b.vehicle));
    list(items, sorted, (it) => it.vehicle, make, (row, it) => fill(row, it, stale));
    attribute(items, "data-stale", stale ? "true" : "false");
  };
}

function severity(it) {
  if (it.contact?.lost) return 20;
  // An advisory, as one's own order is, does not put a vehicle before one in trouble.
  if (it.worst) return { 3: 12, 2: 10, 1: 3 }[alarmOf(it.worstAlarm).rank];
  if (it.waitsFor?.some((wait) => wait.untilS != null)) return 10;
  const ended = it.outcome && it.outcome !== "MISSION_OUTCOME_SUCCESS" ? 6 : 0;
  return Math.max(ended, SEVERITY.indexOf(it.phase?.replace("MISSION_PHASE_", "")));
}

/** For a vehicle that is not heard, for how long: what follows is as old. */
function silenceOf({ contact }) {
  return contact?.lost ? `no contact for ${age(contact.wallAgeS + (performance.now() - store.fleetAt) / 1000)}; was ` : "";
}

function stateOf(it) {
  const state = it.worst ? flag(it.worst) : it.outcome ? `over: ${outcome(it.outcome)}` : phase(it.phase);
  const progress = it.objectives && !it.outcome ? `${Math.min((it.currentObjective ?? 0) + 1, it.objectives)}/${it.objectives}` : "";
  const height = it.flying ? `in the air${it.heightM == null ? "" : `, ${number(it.heightM)} m`}` : "";
  const battery = it.batteryRemaining == null ? "" : `${number(it.batteryRemaining * 100)} %`;
  const waits = (it.waitsFor ?? []).map((wait) => `waits for ${wait.what}`);
  return [state, ...waits, progress, height, battery].filter(Boolean).join(" · ");
}

function make(it) {
  return h(
    "li",
    {},
    h(
      "button",
      { class: "row", click: () => select(it.vehicle) },
      h("span", { class: "lamp", "data-part": "lamp", "aria-hidden": "true" }),
      h("strong", {}, it.vehicle),
      h("span", { class: "muted", "data-part": "state" }),
    ),
  );
}

function fill(row, it, stale) {
  const disconnected = stale || (it.vehicle === store.selected && isCutOff());
  text(part(row, "state"), disconnected ? "not connected" : `${silenceOf(it)}${stateOf(it)}`);
  const level = severity(it);
  attribute(part(row, "lamp"), "data-tone", disconnected ? "none" : level >= 5 ? "bad" : level >= 3 ? "warn" : level >= 0 ? "good" : "none");
  attribute(row.firstElementChild, "aria-current", it.vehicle === store.selected ? "true" : null);
}
