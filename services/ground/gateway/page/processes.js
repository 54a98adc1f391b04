// The processes of the vehicle and of the ground: alive, stale or dead; unheard without contact with the vehicle.

import { attribute, h, list, part, text } from "./dom.js";
import { isCutOff, isStale, silence, store } from "./store.js";
import { age, clock } from "./words.js";

/** Messages that a process did not handle, by the field of its heartbeat. */
const LOSSES = { dropped: "dropped", malformed: "malformed", late: "late", refused: "invalid" };
const TONES = { alive: "good", stale: "warn", dead: "bad" };

export function mountProcesses() {
  const body = document.querySelector("#processes .body");
  const rows = h("tbody", {});
  const heads = ["Process", "Heartbeat", "Up", "Lost"].map((it) => h("th", { scope: "col" }, it));
  body.append(h("table", { class: "processes" }, h("thead", {}, h("tr", {}, ...heads)), rows));
  return () => list(rows, store.doc?.processes ?? [], (it) => it.service, make, fill);
}

function make({ service }) {
  const cell = (name) => h("td", { class: "figure", "data-part": name });
  return h("tr", {}, h("td", {}, h("span", { class: "lamp", "data-part": "lamp" }), service), cell("age"), cell("up"), cell("lost"));
}

function fill(row, { health, wallAgeS, heartbeat }) {
  // The gateway does not receive its own heartbeat: its status events show that it is alive.
  const shown = row.dataset.key === "gateway" && !heartbeat ? (isCutOff() ? "silent" : "alive") : isStale() ? "unknown" : health;
  attribute(part(row, "lamp"), "data-tone", TONES[shown] ?? "none");
  attribute(part(row, "lamp"), "title", shown);
  const seconds = row.dataset.key === "gateway" && !heartbeat ? silence() : wallAgeS == null ? null : wallAgeS + silence();
  text(part(row, "age"), shown === "alive" || shown === "unknown" ? age(seconds) : shown);
  text(part(row, "up"), clock(heartbeat?.uptimeS));
  const losses = Object.entries(LOSSES).map(([field, words]) => [Number(heartbeat?.[field] ?? 0), words]);
  text(part(row, "lost"), heartbeat ? String(losses.reduce((all, [count]) => all + count, 0)) : "–");
  attribute(part(row, "lost"), "title", heartbeat ? losses.map(([count, words]) => `${count} ${words}`).join(", ") : null);
}
