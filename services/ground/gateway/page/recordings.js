// Recorded missions: how each ended, and its file to download.

import { get, save } from "./api.js";
import { announce } from "./orders.js";
import { attribute, h, list, part, text } from "./dom.js";
import { store } from "./store.js";
import { clock, outcome } from "./words.js";

const PERIOD_MS = 5000;
const TONES = { MISSION_OUTCOME_SUCCESS: "good", MISSION_OUTCOME_FAILURE: "bad", MISSION_OUTCOME_EMERGENCY: "bad" };

/** The newest answer of the gateway. */
let answer = null;

export function mountRecordings() {
  const body = document.querySelector("#recordings .body");
  const rows = h("ul", { class: "recordings", "aria-label": "Recorded missions, newest first" });
  const note = h("p", { class: "muted" });
  body.append(note, rows);
  const poll = async () => {
    // That the gateway does not answer is shown elsewhere.
    if (store.session && !document.hidden) answer = await get("/api/v1/recordings").catch(() => answer);
  };
  setInterval(poll, PERIOD_MS);
  let [asked, failing] = [null, false];
  return () => {
    // At once when somebody signs in and when a mission ends.
    const now = `${store.session?.name}-${store.doc?.report?.outcome}`;
    if (now !== asked) poll();
    asked = now;
    text(note, why());
    attribute(note, "hidden", !why());
    // A problem opens the panel.
    if (answer?.state === "failing" && !failing) document.getElementById("recordings").open = true;
    failing = answer?.state === "failing";
    list(rows, answer?.recordings ?? [], (it) => it.id, make, fill);
  };
}

/** The text beside the list. */
function why() {
  if (!answer) return "";
  if (answer.state === "failing") return `Missions cannot be recorded: ${answer.problem}.`;
  if (answer.state === "off") return "Missions are not recorded.";
  return answer.recordings.length ? "" : "No mission is recorded yet.";
}

function make({ id }) {
  const button = h("button", { "data-part": "download", click: () => download(id) }, "Download");
  return h("li", {}, h("span", { class: "badge", "data-part": "outcome" }), h("span", { class: "muted figure", "data-part": "size" }), button, h("span", { "data-part": "what" }));
}

function fill(row, it) {
  const badge = part(row, "outcome");
  text(badge, it.state === "recording" ? "recording" : it.state === "damaged" ? "damaged" : outcome(it.outcome) || "no report");
  attribute(badge, "data-tone", it.state === "damaged" ? "warn" : (TONES[it.outcome] ?? "none"));
  attribute(badge, "title", it.problem ?? it.reason);
  const began = it.started ? new Date(it.started) : null;
  const took = it.started && it.ended ? `, ${clock((Date.parse(it.ended) - began) / 1000)}` : "";
  const name = [it.vehicle, it.mission].filter(Boolean).join(" ") || it.id;
  text(part(row, "what"), `${name}${began ? ` · ${began.toLocaleString()}` : ""}${took}`);
  text(part(row, "size"), it.bytes < 1e6 ? `${Math.ceil(it.bytes / 1e3)} kB` : `${(it.bytes / 1e6).toFixed(1)} MB`);
}

async function download(id) {
  try {
    await save(`/api/v1/recordings/${encodeURIComponent(id)}/file`, `${id}.mcap`);
  } catch (refusal) {
    announce("bad", `Download failed: ${refusal.message}.`);
  }
}
