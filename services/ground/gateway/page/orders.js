// Giving an order: the second step of a hazardous one, the request, and its outcome.
//
// Every order is given here, so that all outcomes appear in one place. An order is of the vehicle that was selected when the operator
// asked for it, and every question and outcome names that vehicle: another one may be selected by the time that it is confirmed or answered.

import * as api from "./api.js";
import { attribute, h, part, text } from "./dom.js";
import { onSelect, store } from "./store.js";

/** A question without an answer is withdrawn after this. */
const QUESTION_MS = 10_000;
/** The gateway's word for an order with which nothing was done. */
const NOTHING_DONE = "urn:kittiwake:problem:unavailable";
/** Orders to the control tower. It recognises no key: the same order once more would be a new decision. */
const TO_TOWER = /^permissions\//;

let confirm = null;
let timer = null;
/** The newest order. */
let last = null;
/** The order that may be given once more, with the same key. */
let repeatable = null;
const withdrawn = new Set();

/** The elements below the orders: the question of a second step, and the outcome. */
export function orderElements() {
  confirm = h("div", { class: "confirm", role: "alertdialog", "aria-labelledby": "question", hidden: true },
    h("span", { id: "question", "data-part": "question" }),
    h("button", { id: "cancel", click: withdraw }, "Cancel"),
    h("button", { id: "confirm", class: "danger", "data-part": "go" }, "Confirm"),
  );
  const said = h("p", { class: "said", id: "said", role: "status" }, "");
  const again = h("button", { id: "again", hidden: true, click: () => repeatable && run(repeatable) }, "Try again");
  onSelect(withdraw);
  onSelect(offerAgain);
  document.addEventListener("keydown", (event) => event.key === "Escape" && withdraw());
  return { confirm, answer: h("div", { class: "answer" }, said, again) };
}

/** Asks before `go`, which gets the vehicle asked about: the button is in another place than the first one, and the focus is on Cancel. */
export function ask(question, label, go) {
  withdraw();
  const vehicle = store.selected;
  attribute(confirm, "hidden", false);
  text(part(confirm, "question"), `${vehicle}: ${question}`);
  const button = part(confirm, "go");
  text(button, `Confirm for ${vehicle}: ${label.replace("…", "")}`);
  button.onclick = () => {
    withdraw();
    go(vehicle);
  };
  document.getElementById("cancel").focus();
  timer = setTimeout(withdraw, QUESTION_MS);
}

/** Calls `listener` whenever the operator cancels, or selects another vehicle. */
export function onWithdraw(listener) {
  withdrawn.add(listener);
}

/** Withdraws the question. */
export function withdraw() {
  clearTimeout(timer);
  for (const listener of withdrawn) listener();
  if (confirm.contains(document.activeElement)) document.getElementById("commands").focus();
  attribute(confirm, "hidden", true);
}

/** Gives an order to a vehicle and shows the outcome; the answer, or `null` when it was refused. */
export function order(vehicle, name, path, body, method = "POST") {
  return run({ vehicle, name, path, body, method, key: api.newKey() });
}

/** Whether this page has ordered another mission of this vehicle within this many seconds. */
export function hasOrderedMissionWithin(vehicle, seconds) {
  return last?.vehicle === vehicle && /^(mission|start)/.test(last.path) && performance.now() - last.at < seconds * 1000;
}

async function run(it) {
  last = { ...it, at: performance.now() };
  const what = `${it.vehicle}, ${it.name}`;
  announce("", `${what}: sent…`);
  try {
    const url = `/api/v1/vehicles/${encodeURIComponent(it.vehicle)}/${it.path}`;
    const answer = await api.command(it.method, url, it.body, it.key);
    announce("good", `${what}: ${answer.text || "done"}`);
    return answer;
  } catch (refusal) {
    // An error of the page itself is shown on the console.
    if (!(refusal instanceof api.Refusal)) throw refusal;
    announce("bad", `${what}: ${whyNot(it, refusal)}`, mayRepeat(it, refusal) ? it : null);
    return null;
  }
}

/**
 * Whether nobody knows if the order was carried out: no answer came, or something failed and the gateway does not say that nothing was done.
 * A proxy on the way does not know, nor does a gateway that has made a mistake, or that was answered what it has not asked.
 */
function isUnknown({ status, document }) {
  return status === 0 || (500 <= status && document.type !== NOTHING_DONE);
}

/**
 * Whether the same order may be given once more. The vehicle recognises its key, so that one that did arrive has no second effect (but for
 * faults by hand, of a simulated vehicle). A decision of the control tower would be made a second time, after what others have decided since.
 */
function mayRepeat(it, refusal) {
  return isUnknown(refusal) ? !TO_TOWER.test(it.path) : [408, 503].includes(refusal.status);
}

function whyNot(it, refusal) {
  if (!isUnknown(refusal)) return `refused: ${refusal.message}`;
  if (!TO_TOWER.test(it.path)) return `no answer: ${refusal.message}`;
  return "no answer, and nobody knows whether it was done. See what is decided at present before you decide again: others may have decided since.";
}

/** Shows the outcome of an order, and offers to give `again` once more. */
export function announce(tone, words, again = null) {
  const said = document.getElementById("said");
  text(said, words);
  attribute(said, "data-tone", tone || null);
  repeatable = again;
  offerAgain();
}

/** Offers what may be repeated while its vehicle is selected. */
function offerAgain() {
  const again = document.getElementById("again");
  attribute(again, "hidden", !repeatable || repeatable.vehicle !== store.selected);
  text(again, repeatable ? `Try again: ${repeatable.name}, ${repeatable.vehicle}` : "Try again");
}
