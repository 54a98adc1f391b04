// The first line: phase and time, who is signed in, who holds command, light or dark.

import { command, keepToken } from "./api.js";
import { attribute, disabledFor, h, part, text } from "./dom.js";
import { has, inCommand, isStale, openSession, store } from "./store.js";
import { clock, outcome, phase } from "./words.js";
import { announce } from "./commands.js";

const THEME = "kittiwake.theme";
const THEMES = { auto: "Auto", light: "Light", dark: "Dark" };

export function mountTop() {
  mountSignIn();
  const headline = document.getElementById("headline");
  headline.append(
    h("strong", { "data-part": "vehicle" }),
    h("span", { class: "muted", "data-part": "mission" }),
    h("span", { class: "badge", id: "phase" }),
    h("span", { class: "muted" }, "Mission time ", h("b", { class: "figure", id: "mission-time" })),
  );
  const session = document.getElementById("session");
  const take = h("button", { id: "take-command", click: () => helm(inCommand() ? "release" : "take") });
  session.append(
    h("span", { class: "muted", "data-part": "holder" }),
    take,
    h("span", { "data-part": "who" }),
    themeSwitch(),
  );
  return () => {
    const doc = store.doc;
    text(part(headline, "vehicle"), store.selected ?? "No vehicle");
    text(part(headline, "mission"), doc?.mission?.name ? `Mission ${doc.mission.name}` : "");
    const badge = document.getElementById("phase");
    const report = doc?.report;
    text(badge, report ? `over: ${outcome(report.outcome)}` : phase(doc?.mission?.phase));
    attribute(badge, "data-tone", tone(doc));
    text(document.getElementById("mission-time"), clock(doc?.missionTimeS));
    const who = part(session, "who");
    text(who, store.session ? store.session.name : "watching");
    attribute(who, "title", store.session ? `Roles: ${store.session.roles.join(", ")}` : "Nobody is signed in");
    const holder = doc?.command?.holder;
    const offered = doc?.command?.offeredTo;
    text(part(session, "holder"), !doc?.command ? "" : holder ? `Command: ${holder}${offered ? `, offered to ${offered}` : ""}` : "Command: nobody");
    attribute(take, "hidden", !doc?.command || !has("operator"));
    text(take, inCommand() ? "Release command" : "Take command");
    disabledFor(take, isStale() ? "not connected" : holder && !inCommand() && offered !== store.session?.name ? `${holder} holds command` : "");
  };
}

function tone(doc) {
  if (doc?.report) return doc.report.outcome === "MISSION_OUTCOME_SUCCESS" ? "good" : "bad";
  const tones = { CONTINGENCY: "bad", REPLANNING: "warn", NOMINAL: "good", ENDING: "warn" };
  return tones[doc?.mission?.phase?.replace("MISSION_PHASE_", "")] ?? "none";
}

async function helm(what) {
  try {
    const held = await command("POST", `/api/v1/vehicles/${encodeURIComponent(store.selected)}/command/${what}`);
    if (store.doc) store.doc.command = held;
    announce("good", what === "take" ? "You hold command." : "Command is released.");
  } catch (refusal) {
    announce("bad", `Not done: ${refusal.message}.`);
  }
}

function themeSwitch() {
  const kept = localStorage.getItem(THEME);
  const select = h("select", { "aria-label": "Light or dark", id: "theme" });
  for (const [value, label] of Object.entries(THEMES)) select.append(h("option", { value }, label));
  const apply = () => attribute(document.documentElement, "data-theme", select.value === "auto" ? null : select.value);
  select.value = kept in THEMES ? kept : "auto";
  select.addEventListener("change", () => {
    localStorage.setItem(THEME, select.value);
    apply();
  });
  apply();
  return select;
}

function mountSignIn() {
  const dialog = document.getElementById("sign-in");
  const field = document.getElementById("token");
  dialog.addEventListener("close", () => {
    if (field.value) keepToken(field.value);
    field.value = "";
    openSession();
  });
  setInterval(() => {
    if (store.signIn && !dialog.open) {
      text(document.getElementById("sign-in-why"), sessionStorage.length ? `The token was refused: ${store.signIn}.` : "");
      dialog.showModal();
    }
  }, 250);
}
