// Who has command of the vehicle: taking it, releasing it, offering it to another operator.

import { attribute, disabledFor, h, text } from "./dom.js";
import { changed, has, inCommand, isCutOff, onSelect, store } from "./store.js";
import { command, Refusal } from "./api.js";
import { announce } from "./orders.js";

/** The vehicle that this session had command of at the last change, to notice when another operator takes command. */
let had = null;

export function mountCommandAuthority() {
  const place = document.getElementById("command-authority");
  const holder = h("span", { class: "muted", id: "holder" });
  const take = h("button", { id: "take-command", click: () => change(inCommand() ? "release" : "take") });
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
    if (name && (await change("hand-over", { to: name }, `Command of ${store.selected} is offered to ${name}. You have it until ${name} takes it.`))) open(false);
  }
  // Of another vehicle nothing was to be handed over.
  onSelect(() => open(false));
  form.addEventListener("keydown", (event) => event.key === "Escape" && open(false));
  place.append(holder, take, offer, form);
  return () => {
    const authority = store.doc?.command;
    const me = store.session?.name;
    const offered = authority?.offeredTo;
    text(holder, !authority ? "" : authority.holder ? `Command: ${authority.holder}${offered ? `, offered to ${offered}` : ""}` : "Command: nobody");
    attribute(take, "hidden", !authority || !has("operator"));
    const mine = inCommand();
    const invited = Boolean(offered) && offered === me && !mine;
    text(take, mine ? "Release command" : invited ? `Take command from ${authority.holder}` : "Take command");
    attribute(take, "class", invited ? "primary" : null);
    const why = isCutOff() ? "not connected" : authority?.holder && !mine && !invited ? `${authority.holder} has command` : "";
    disabledFor(take, why);
    attribute(offer, "hidden", !mine);
    disabledFor(offer, isCutOff() ? "not connected" : "");
    if (!mine) open(false);
    noticeLoss(authority, mine);
    fillNames(names, me);
  };
}

function noticeLoss(authority, mine) {
  if (had === store.selected && !mine && authority && !isCutOff()) {
    if (authority.holder) announce("bad", `${authority.holder} has command of ${store.selected} now.`);
    had = null;
  }
  if (mine) had = store.selected;
}

/** Suggests the operators who have ordered something recently. */
function fillNames(names, me) {
  const known = new Set(store.events.filter((it) => it.type === "audit").map((it) => it.data.who).filter((it) => it && it !== me));
  if ([...names.children].map((it) => it.value).join() === [...known].join()) return;
  names.replaceChildren(...[...known].map((value) => h("option", { value })));
}

async function change(what, body, words = null) {
  const vehicle = store.selected;
  try {
    const now = await command("POST", `/api/v1/vehicles/${encodeURIComponent(vehicle)}/command/${what}`, body);
    // Command that was released on purpose is not lost.
    if (what === "release" && had === vehicle) had = null;
    if (store.doc && store.selected === vehicle) store.doc.command = now;
    announce("good", words ?? `You have ${what === "take" ? "" : "released "}command of ${vehicle}.`);
    changed();
    return true;
  } catch (refusal) {
    if (!(refusal instanceof Refusal)) throw refusal;
    announce("bad", `${vehicle}: Refused: ${refusal.message}.`);
    return false;
  }
}
