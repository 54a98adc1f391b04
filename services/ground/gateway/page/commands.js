// The verbs. Hazardous ones take two steps, and the second button is not where the first one was.

import * as api from "./api.js";
import { attribute, disabledFor, h, part, text } from "./dom.js";
import { has, inCommand, isStale, store } from "./store.js";
import { number } from "./words.js";
import { pickPlace, stopPicking } from "./map.js";

/** `safety`: also without command. `question`: what the second step says. */
const VERBS = [
  { verb: "start", label: "Start", help: "Start the mission", when: (o) => (o && !o.startAwaited ? "no start is awaited" : "") },
  { verb: "pause", label: "Hold", help: "Hold here until resumed", safety: true, when: (o) => (o?.paused ? "holds already" : "") },
  { verb: "resume", label: "Resume", help: "Go on with the mission", when: (o) => (o && !o.paused ? "not held" : "") },
  { verb: "replan", label: "Replan", help: "Make a new plan from here" },
  { verb: "return", label: "Return", help: "Fly home and land", safety: true, question: "Give up the mission, fly home and land there?" },
  { verb: "land-at", label: "Land at…", help: "Land at a place chosen on the map", safety: true, place: true },
  { verb: "abort", label: "Abort", help: "End the mission now", safety: true, question: "End the mission now and land?" },
];
/** A question nobody answers is withdrawn. */
const QUESTION_MS = 10_000;

let bar;
let timer;
let last;

export function mountCommands() {
  const panel = document.getElementById("commands");
  const buttons = VERBS.map((it) =>
    h("button", { id: `verb-${it.verb}`, "data-help": it.help, class: it.question || it.place ? "hazard" : null, click: () => begin(it) }, it.label),
  );
  const confirm = h("div", { class: "confirm", role: "alertdialog", "aria-labelledby": "question", hidden: true, "data-part": "confirm" },
    h("span", { id: "question", "data-part": "question" }),
    h("button", { id: "cancel", click: withdraw }, "Cancel"),
    h("button", { id: "confirm", class: "danger", "data-part": "go" }, "Confirm"),
  );
  const said = h("p", { class: "said", id: "said", role: "status" }, "");
  const again = h("button", { id: "again", hidden: true, "data-part": "again", click: () => last && run(last) }, "Try again");
  bar = panel;
  panel.append(h("div", { class: "verbs", role: "group", "aria-label": "Verbs" }, ...buttons), confirm, approval(), h("div", { class: "answer" }, said, again));
  document.addEventListener("keydown", (event) => event.key === "Escape" && withdraw());
  return () => {
    for (const [index, it] of VERBS.entries()) disabledFor(buttons[index], why(it));
    disabledFor(part(panel, "go"), isStale() ? "not connected" : "");
    fillApproval();
  };
}

/** Why a verb cannot be given now; empty when it can. The gateway has the last word. */
function why(it) {
  if (isStale()) return "not connected";
  if (!store.session) return "this gateway is one to watch only";
  if (!(it.safety && has("safety"))) {
    if (!has("operator")) return `needs the role operator${it.safety ? " or safety" : ""}`;
    if (!inCommand()) return "take command first";
  }
  if (store.doc?.mission?.phase === "MISSION_PHASE_OVER") return "the mission is over";
  return it.when?.(store.doc?.operator) ?? "";
}

async function begin(it) {
  withdraw();
  if (it.place) {
    announce("", "Choose the place on the map: click, or move the mark with the arrow keys and press Enter. Escape cancels.");
    const place = await pickPlace();
    if (!place) return announce("", "");
    const body = { position: { northM: place.north, eastM: place.east } };
    return ask(`Give up the mission and land at N ${number(place.north)}, E ${number(place.east)}?`, it.label, () => order(it.verb, it.verb, body));
  }
  if (it.question) return ask(it.question, it.label, () => order(it.verb, it.verb));
  return order(it.verb, it.verb);
}

function ask(question, label, go) {
  const confirm = part(bar, "confirm");
  attribute(confirm, "hidden", false);
  text(part(confirm, "question"), question);
  const button = part(confirm, "go");
  text(button, `Confirm: ${label.replace("…", "")}`);
  button.onclick = () => {
    withdraw();
    go();
  };
  document.getElementById("cancel").focus();
  timer = setTimeout(withdraw, QUESTION_MS);
}

function withdraw() {
  clearTimeout(timer);
  stopPicking();
  const confirm = part(bar, "confirm");
  if (confirm.contains(document.activeElement)) bar.focus();
  attribute(confirm, "hidden", true);
}

/** Gives an order under the chosen vehicle and says what came of it. */
export async function order(name, path, body) {
  const url = `/api/v1/vehicles/${encodeURIComponent(store.selected)}/${path}`;
  return run({ name, url, body, key: api.newKey() });
}

async function run(it) {
  last = it;
  announce("", `${it.name}: sent…`);
  try {
    const answer = await api.command("POST", it.url, it.body, it.key);
    announce("good", `${it.name}: ${answer.text || "done"}`);
  } catch (refusal) {
    announce("bad", `${it.name}: ${refusal.status ? "refused" : "no answer"}: ${refusal.message}`, [0, 408, 503].includes(refusal.status));
  }
}

/** Writes the outcome of an order beneath the verbs. */
export function announce(tone, words, repeatable = false) {
  const said = document.getElementById("said");
  text(said, words);
  attribute(said, "data-tone", tone || null);
  // The same key: an order that did arrive is not carried out twice.
  attribute(document.getElementById("again"), "hidden", !repeatable);
}

function approval() {
  const decide = (approve) => () =>
    order("plan", "plan/decision", { revision: store.doc?.operator?.planApproval?.revision, approve });
  return h("div", { class: "confirm", id: "approval", hidden: true },
    h("span", { "data-part": "approval-words" }),
    h("button", { "data-part": "reject", click: decide(false) }, "Reject plan"),
    h("button", { class: "primary", "data-part": "approve", click: decide(true) }, "Approve plan"),
  );
}

function fillApproval() {
  const asked = store.doc?.operator?.planApproval;
  attribute(document.getElementById("approval"), "hidden", !asked);
  if (!asked) return;
  const steps = asked.plan?.steps?.length ?? 0;
  text(part(bar, "approval-words"), `Plan ${asked.revision} of ${steps} steps waits for approval. In ${number(asked.untilS)} s it is ${asked.approveByDefault ? "approved" : "rejected"} by default.`);
  const reason = isStale() ? "not connected" : inCommand() ? "" : "take command first";
  disabledFor(part(bar, "reject"), reason);
  disabledFor(part(bar, "approve"), reason);
}
