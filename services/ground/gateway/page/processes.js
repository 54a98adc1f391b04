// The processes of the vehicle and of the ground: alive, stale or dead.

import { attribute, h, list, part, text } from "./dom.js";
import { isStale, silence, store } from "./store.js";
import { age, clock } from "./words.js";

const TONES = { alive: "good", stale: "warn", dead: "bad" };
/** Comes for one message and leaves: its absence is no trouble. */
const VISITOR = "injector";

export function mountProcesses() {
  const body = document.querySelector("#processes .body");
  const rows = h("tbody", {});
  const heads = ["Process", "Heartbeat", "Up", "Lost"].map((it) => h("th", { scope: "col" }, it));
  body.append(h("table", { class: "processes" }, h("thead", {}, h("tr", {}, ...heads)), rows));
  return () => list(rows, (store.doc?.processes ?? []).filter((it) => it.service !== VISITOR), (it) => it.service, make, fill);
}

function make({ service }) {
  const cell = (name) => h("td", { class: "figure", "data-part": name });
  return h("tr", {}, h("td", {}, h("span", { class: "lamp", "data-part": "lamp" }), service), cell("age"), cell("up"), cell("lost"));
}

function fill(row, { health, wallAgeS, heartbeat }) {
  // The gateway cannot hear its own heartbeat: that its status arrives is its sign of life.
  const shown = row.dataset.key === "gateway" && !heartbeat ? (isStale() ? "silent" : "alive") : isStale() ? "unknown" : health;
  attribute(part(row, "lamp"), "data-tone", TONES[shown] ?? "none");
  attribute(part(row, "lamp"), "title", shown);
  const seconds = row.dataset.key === "gateway" && !heartbeat ? silence() : wallAgeS == null ? null : wallAgeS + silence();
  text(part(row, "age"), shown === "alive" || shown === "unknown" ? age(seconds) : shown);
  text(part(row, "up"), clock(heartbeat?.uptimeS));
  const lost = Number(heartbeat?.dropped ?? 0) + Number(heartbeat?.malformed ?? 0);
  text(part(row, "lost"), heartbeat ? String(lost) : "–");
  attribute(part(row, "lost"), "title", heartbeat ? `${heartbeat.dropped} dropped, ${heartbeat.malformed} malformed of ${heartbeat.handled}` : null);
}
