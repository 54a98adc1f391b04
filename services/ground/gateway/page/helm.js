// Who holds command of the vehicle: taking it, releasing it, offering it to somebody else.

import { attribute, disabledFor, h, text } from "./dom.js";
import { changed, has, inCommand, isStale, store } from "./store.js";
import { command, Refusal } from "./api.js";
import { announce } from "./orders.js";

/** Whether it was held when last looked, to notice that somebody else took it. */
let held = null;

export function mountHelm() {
  const place = document.getElementById("helm");
  const holder = h("span", { class: "muted", id: "holder" });
  const take = h("button", { id: "take-command", click: () => move(inCommand() ? "release" : "take") });
  const offer = h("button", { id: "offer-command", "aria-expanded": "false", click: () => open(form.hidden) }, "Hand over…");
  const names = h("datalist", { id: "operators" });
  const to = h("input", { id: "offer-to", list: "operators", placeholder: "Operator's name", "aria-label": "Hand command over to", autocomplete: "off", maxlength: 64, required: true });
  const form = h("form", { class: "offer", hidden: true, submit: onSubmit }, to, names, h("button", { class: "primary" }, "Offer command"));
  const open = (yes) => {
    attribute(form, "hidden", !yes);
    attribute(offer, "aria-expanded", String(yes));
    if (yes) to.focus();
  };
  async function onSubmit(event) {
    event.preventDefault();
    const name = to.value.trim();
    if (name && (await move("hand-over", { to: name }, `Command is offered to ${name}; you hold it until it is taken.`))) open(false);
  }
  form.addEventListener("keydown", (event) => event.key === "Escape" && open(false));
  place.append(holder, take, offer, form);
  return () => {
    const helm = store.doc?.command;
    const me = store.session?.name;
    const offered = helm?.offeredTo;
    text(holder, !helm ? "" : helm.holder ? `Command: ${helm.holder}${offered ? `, offered to ${offered}` : ""}` : "Command: nobody");
    attribute(take, "hidden", !helm || !has("operator"));
    const mine = inCommand();
    const invited = Boolean(offered) && offered === me && !mine;
    text(take, mine ? "Release command" : invited ? `Take command from ${helm.holder}` : "Take command");
    attribute(take, "class", invited ? "primary" : null);
    const why = isStale() ? "not connected" : helm?.holder && !mine && !invited ? `${helm.holder} holds command` : "";
    disabledFor(take, why);
    attribute(offer, "hidden", !mine);
    disabledFor(offer, isStale() ? "not connected" : "");
    if (!mine) open(false);
    noticeLoss(helm, mine);
    fillNames(names, me);
  };
}

function noticeLoss(helm, mine) {
  if (held === store.selected && !mine && helm && !isStale()) {
    if (helm.holder) announce("bad", `${helm.holder} holds command of ${store.selected} now.`);
    held = null;
  }
  if (mine) held = store.selected;
}

/** Whoever has ordered something of late. */
function fillNames(names, me) {
  const known = new Set(store.events.filter((it) => it.type === "audit").map((it) => it.data.who).filter((it) => it && it !== me));
  if ([...names.children].map((it) => it.value).join() === [...known].join()) return;
  names.replaceChildren(...[...known].map((value) => h("option", { value })));
}

async function move(what, body, words = what === "take" ? "You hold command." : "Command is released.") {
  try {
    const now = await command("POST", `/api/v1/vehicles/${encodeURIComponent(store.selected)}/command/${what}`, body);
    // What is given up by hand is not lost.
    if (what === "release") held = null;
    if (store.doc) store.doc.command = now;
    announce("good", words);
    changed();
    return true;
  } catch (refusal) {
    if (!(refusal instanceof Refusal)) throw refusal;
    announce("bad", `Not done: ${refusal.message}.`);
    return false;
  }
}
