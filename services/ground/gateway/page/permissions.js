// One card for each area that needs a permission, with buttons for those who may decide.

import { attribute, disabledFor, h, list, part, text } from "./dom.js";
import { has, isCutOff, store } from "./store.js";
import { clock, permission, sentence } from "./words.js";
import { ask, order } from "./orders.js";
import { awaitedWords, expiryWords } from "./legs.js";
import { feedsByArea } from "./feeds.js";

/** The tone of each state, here and on the map. */
export const TONES = { REQUESTED: "warn", GRANTED: "good", DENIED: "bad", REVOKED: "bad", EXPIRED: "old" };
const DECISIONS = [
  ["DECISION_GRANT", "Grant"],
  ["DECISION_DENY", "Deny"],
  ["DECISION_REVOKE", "Revoke"],
];
/** Cards that need a decision come first. */
const URGENCY = ["REQUESTED", "REVOKED", "DENIED", "EXPIRED", "GRANTED"];

export function mountPermissions() {
  const body = document.querySelector("#permissions .body");
  const cards = h("ul", { class: "cards" });
  const none = h("p", { class: "empty" }, "");
  const accept = h("button", { id: "accept-loss", class: "hazard", click: () => ask("Let the control tower grant again without its earlier decisions? It does so for every other vehicle too.", "Accept the loss", (vehicle) => order(vehicle, "accept the loss", "permissions/accept-loss")) }, "Accept the loss");
  const stale = h("p", { class: "reason", id: "permissions-stale", role: "status" }, "");
  body.append(stale, accept, none, cards);
  return () => {
    text(stale, staleness() && `Stale: ${staleness()}. Nobody knows whether these still hold.`);
    attribute(stale, "hidden", !staleness());
    attribute(accept, "hidden", !store.doc?.tower?.memory?.loss || !has("tower"));
    const items = cardsOf(store.doc);
    attribute(none, "hidden", !store.doc || items.length > 0);
    // The mission manager says which areas there are; its silence is not the same as no areas.
    text(none, store.doc?.sources?.missionStatus?.wallAgeS == null ? "Not known yet: nothing was heard of the mission." : "No area of this mission needs a permission.");
    list(cards, items, (it) => it.area, make, fill);
  };
}

/** Why the tower's decisions may be others by now; empty while they are fresh. */
export function staleness() {
  return store.doc?.tower?.stale ?? "";
}

function cardsOf(doc) {
  const ledger = new Map((doc?.permissions ?? []).map((it) => [it.area, it]));
  const areas = (doc?.areas ?? []).filter((it) => it.kind === "AREA_KIND_PERMISSION").map((it) => it.name);
  const feeds = feedsByArea(doc);
  const rank = (it) => (URGENCY.indexOf(short(it.state)) + URGENCY.length + 1) % (URGENCY.length + 1);
  return [...new Set([...areas, ...ledger.keys()])]
    .map((area) => ledger.get(area) ?? { area, state: "PERMISSION_STATE_UNSPECIFIED" })
    .map((it) => ({ ...it, feed: feeds.get(it.area), order: it.state.endsWith("UNSPECIFIED") ? 9 : rank(it) }))
    .sort((a, b) => a.order - b.order || a.area.localeCompare(b.area));
}

/** `PERMISSION_STATE_GRANTED` -> `GRANTED`. */
export function short(state) {
  return (state ?? "").replace("PERMISSION_STATE_", "");
}

function make({ area }) {
  const why = h("input", { "data-part": "why", placeholder: "Reason (optional)", "aria-label": `Reason for the decision about area ${area}`, maxlength: 200, autocomplete: "off" });
  const decide = async (vehicle, decision, label) => {
    const done = await order(vehicle, `${label.toLowerCase()} area ${area}`, `permissions/${encodeURIComponent(area)}/decision`, { decision, reason: why.value.trim() });
    if (done) why.value = "";
  };
  const press = (decision, label) =>
    decision === "DECISION_REVOKE" ? ask(`Revoke the permission for area ${area}? The vehicle must leave it or fly round it.`, label, (vehicle) => decide(vehicle, decision, label)) : decide(store.selected, decision, label);
  const buttons = DECISIONS.map(([decision, label]) =>
    h("button", { "data-decision": decision, class: decision === "DECISION_REVOKE" ? "hazard" : null, "aria-label": `${label} area ${area}`, click: () => press(decision, label) }, label),
  );
  return h(
    "li",
    { class: "card", "data-area": area },
    h("div", { class: "card-head" }, h("strong", {}, `Area ${area}`), h("span", { class: "badge", "data-part": "state" }), h("span", { class: "figure muted", "data-part": "until" })),
    h("p", { class: "reason", "data-part": "reason" }),
    h("p", { class: "muted", "data-part": "feed" }),
    h("div", { class: "buttons", "data-part": "buttons" }, why, ...buttons),
  );
}

function fill(card, it) {
  const state = short(it.state);
  const stale = staleness() !== "";
  text(part(card, "state"), permission(it.state) + (stale ? ", stale" : ""));
  attribute(part(card, "state"), "data-tone", stale ? TONES.EXPIRED : TONES[state] ?? "none");
  attribute(card, "data-stale", stale ? "" : null);
  attribute(card, "data-state", state.toLowerCase());
  text(part(card, "until"), state === "GRANTED" && it.validForS ? `for ${clock(it.validForS)} more` : "");
  const expires = expiryWords(it);
  attribute(card, "data-expires", expires ? "" : null);
  text(part(card, "reason"), [it.enteredBecause && `Entered without permission: ${it.enteredBecause}`, awaitedWords(it.area), expires, it.reason].filter(Boolean).map(sentence).join(" "));
  text(part(card, "feed"), it.feed ? `From ${it.feed}` : "");
  attribute(part(card, "feed"), "hidden", !it.feed);
  attribute(part(card, "buttons"), "hidden", !has("tower"));
  for (const button of card.querySelectorAll("[data-decision]")) {
    // Of a tower that has lost its decisions nothing is granted, and everything can be revoked.
    const lost = Boolean(store.doc?.tower?.memory?.loss);
    const wrong = lost ? { DECISION_GRANT: true } : { DECISION_GRANT: state === "GRANTED", DECISION_DENY: state === "DENIED" || state === "GRANTED", DECISION_REVOKE: state !== "GRANTED" };
    attribute(button, "hidden", wrong[button.dataset.decision]);
    disabledFor(button, isCutOff() ? "not connected" : "");
  }
}
