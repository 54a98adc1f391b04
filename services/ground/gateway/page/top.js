// The top line: phase and mission time, who is signed in, light or dark.

import { keepToken } from "./api.js";
import { alarmOf } from "./alarms.js";
import { responding } from "./response.js";
import { attribute, h, part, text } from "./dom.js";
import { isCutOff, lostFor, openSession, renew, store } from "./store.js";
import { waitingWords } from "./legs.js";
import { mountLayout } from "./layout.js";
import { announce, hasOrderedMissionWithin } from "./orders.js";
import { age, clock, number, outcome, phase, sentence } from "./words.js";

const THEME = "kittiwake.theme";
const THEMES = { auto: "Auto", light: "Light", dark: "Dark" };

export function mountTop() {
  mountSignIn();
  const headline = document.getElementById("headline");
  headline.append(
    h("strong", { "data-part": "vehicle" }),
    h("span", { class: "muted", "data-part": "mission" }),
    h("span", { class: "badge", id: "phase" }),
    h("span", { id: "response" }),
    h("span", { class: "muted" }, "Mission time ", h("b", { class: "figure", id: "mission-time" })),
    h("span", { class: "muted" }, h("b", { class: "figure", id: "utc" }), " UTC"),
    h("span", { class: "badge", "data-tone": "old", id: "simulated", hidden: true }),
  );
  const session = document.getElementById("session");
  session.append(h("span", { class: "command-authority", id: "command-authority" }), h("span", { "data-part": "who" }), mountLayout(), themeSwitch());
  let flown = {};
  return () => {
    const doc = store.doc;
    flown = tellAnotherMission(flown);
    text(part(headline, "vehicle"), store.selected ?? "No vehicle");
    text(part(headline, "mission"), doc?.mission?.name ? `Mission ${doc.mission.name}` : "");
    const badge = document.getElementById("phase");
    const report = doc?.report;
    const lost = !isCutOff() && lostFor() != null;
    text(badge, lost ? `no contact for ${age(lostFor())}` : report ? `over: ${outcome(report.outcome)}` : doc?.operator?.startAwaited ? "waits for start" : phase(doc?.mission?.phase));
    attribute(badge, "data-tone", lost ? "bad" : tone(doc));
    text(document.getElementById("response"), lost || report ? "" : responding(doc) || sentence(waitingWords()));
    text(document.getElementById("mission-time"), doc && doc.missionTimeS == null ? "not known yet" : clock(doc?.missionTimeS));
    text(document.getElementById("utc"), doc?.utc ? doc.utc.slice(11, 19) : "–");
    const simulated = document.getElementById("simulated");
    attribute(simulated, "hidden", !store.session?.simulation);
    text(simulated, `SIMULATED${1 < (store.session?.speed ?? 1) ? ` ×${number(store.session.speed)}` : ""}`);
    const who = part(session, "who");
    text(who, store.session ? store.session.name : "not signed in");
    attribute(who, "title", store.session ? `Roles: ${store.session.roles.join(", ")}` : null);
  };
}

/** Says that the vehicle flies another mission than it did: operators who have not ordered that must know. Returns what is flown. */
function tellAnotherMission(before) {
  const [vehicle, mission] = [store.selected, store.doc?.mission?.name];
  if (!mission) return before.vehicle === vehicle ? before : {};
  const is = { vehicle, mission };
  if (before.vehicle === vehicle && before.mission !== mission && !hasOrderedMissionWithin(vehicle, 30)) {
    announce("", `${vehicle} has another mission now: ${mission} in place of ${before.mission}. What it has flown of that is under Recorded missions.`);
  }
  return is;
}

function tone(doc) {
  if (doc?.report) return doc.report.outcome === "MISSION_OUTCOME_SUCCESS" ? "good" : "bad";
  const acting = doc?.contingencies?.active?.find((it) => it.flag === doc.contingencies.acting);
  if (acting) return alarmOf(acting.alarm).tone;
  const tones = { CONTINGENCY: "bad", REPLANNING: "warn", NOMINAL: "good", ENDING: "warn" };
  return tones[doc?.mission?.phase?.replace("MISSION_PHASE_", "")] ?? "none";
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
    renew();
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
      text(document.getElementById("sign-in-why"), sessionStorage.length ? `Refused: ${store.signIn}.` : "");
      dialog.showModal();
    }
  }, 250);
}
