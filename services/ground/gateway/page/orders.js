// Giving an order: the second step of a hazardous one, the request, and its outcome.
//
// Every order is given here, so that all outcomes appear in one place.

import * as api from "./api.js";
import { attribute, h, part, text } from "./dom.js";
import { store } from "./store.js";

/** A question without an answer is withdrawn after this. */
const QUESTION_MS = 10_000;

let confirm = null;
let timer = null;
let last = null;
const withdrawn = new Set();

/** The elements below the orders: the question of a second step, and the outcome. */
export function orderElements() {
  confirm = h("div", { class: "confirm", role: "alertdialog", "aria-labelledby": "question", hidden: true },
    h("span", { id: "question", "data-part": "question" }),
    h("button", { id: "cancel", click: withdraw }, "Cancel"),
    h("button", { id: "confirm", class: "danger", "data-part": "go" }, "Confirm"),
  );
  const said = h("p", { class: "said", id: "said", role: "status" }, "");
  const again = h("button", { id: "again", hidden: true, click: () => last && run(last) }, "Try again");
  document.addEventListener("keydown", (event) => event.key === "Escape" && withdraw());
  return { confirm, answer: h("div", { class: "answer" }, said, again) };
}

/** Asks before `go`: the button is in another place than the first one, and the focus is on Cancel. */
export function ask(question, label, go) {
  withdraw();
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

/** Calls `listener` whenever the operator cancels. */
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

/** Gives an order to the selected vehicle and shows the outcome; the answer, or `null` when it was refused. */
export function order(name, path, body, method = "POST") {
  const url = `/api/v1/vehicles/${encodeURIComponent(store.selected)}/${path}`;
  return run({ name, url, body, method, key: api.newKey() });
}

/** Whether this page has ordered another mission within this many seconds. */
export function hasOrderedMissionWithin(seconds) {
  return /\/(mission|start)/.test(last?.url ?? "") && performance.now() - last.at < seconds * 1000;
}

async function run(it) {
  last = { ...it, at: performance.now() };
  announce("", `${it.name}: sent…`);
  try {
    const answer = await api.command(it.method, it.url, it.body, it.key);
    announce("good", `${it.name}: ${answer.text || "done"}`);
    return answer;
  } catch (refusal) {
    // An error of the page itself is shown on the console.
    if (!(refusal instanceof api.Refusal)) throw refusal;
    announce("bad", `${it.name}: ${refusal.status ? "refused" : "no answer"}: ${refusal.message}`, [0, 408, 503].includes(refusal.status));
    return null;
  }
}

/** Shows the outcome of an order. */
export function announce(tone, words, repeatable = false) {
  const said = document.getElementById("said");
  text(said, words);
  attribute(said, "data-tone", tone || null);
  // With the same key: an order that did arrive is not carried out twice.
  attribute(document.getElementById("again"), "hidden", !repeatable);
}
