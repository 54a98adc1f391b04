// The orders. A hazardous one takes two steps, and the second button is in another place than the first.

import { attribute, disabledFor, h, part, text } from "./dom.js";
import { has, inCommand, isCutOff, lostFor, store } from "./store.js";
import { age, capital, number } from "./words.js";
import { markPlace, pickPlace, stopPicking } from "./map-input.js";
import { announce, ask, onWithdraw, order, orderElements, withdraw } from "./orders.js";
import { approval } from "./approval.js";

/** `safety`: the role safety may give the order without command. `question`: the second step. `after`: shown only then. */
const VERBS = [
  { verb: "start", label: "Start", help: "Start the mission", when: (o) => (o && !o.startAwaited ? "the mission does not wait for a start" : "") },
  { verb: "pause", label: "Hold", help: "Hold here until resumed", safety: true, when: (o) => (o?.paused ? "already holding" : "") },
  { verb: "resume", label: "Resume", help: "Go on with the mission", when: (o) => (o && !o.paused ? "not holding for an operator" : "") },
  { verb: "replan", label: "Replan", help: "Give up the present step and plan from here" },
  { verb: "return", label: "Return", help: "Fly home and land; on the ground, stay there and end the mission", safety: true, question: "End the mission, fly home and land there?" },
  { verb: "land-at", label: "Land at…", help: "Land at a place chosen on the map", safety: true, place: true },
  { verb: "inspected", label: "Inspected", help: "The vehicle was inspected after the crash and may fly", after: (o) => Boolean(o?.uninspectedCrash), question: "Was the vehicle inspected, and may it fly again?" },
  { verb: "abort", label: "Abort", help: "End the mission now", safety: true, question: "End the mission now and land?" },
];

export function mountCommands() {
  const panel = document.getElementById("commands");
  const buttons = VERBS.map((it) =>
    h("button", { id: `verb-${it.verb}`, "data-help": it.help, class: it.question || it.place ? "hazard" : null, click: () => begin(it) }, it.label),
  );
  const { confirm, answer } = orderElements();
  const plan = approval();
  const reasons = h("p", { class: "reasons", id: "verb-reasons" });
  panel.append(h("div", { class: "verbs", role: "group", "aria-label": "Orders" }, ...buttons), reasons, confirm, plan.element, answer);
  onWithdraw(stopPicking);
  return () => {
    const operator = store.doc?.operator;
    const whys = VERBS.map((it) => (isShown(it) ? why(it) : ""));
    for (const [index, it] of VERBS.entries()) {
      attribute(buttons[index], "hidden", !isShown(it));
      disabledFor(buttons[index], whys[index]);
    }
    const crash = operator?.uninspectedCrash ? `The vehicle has crashed, ${operator.uninspectedCrash}. Inspect it, then order Inspected. ` : "";
    // Also for who has no pointer to rest on a button.
    text(reasons, `${crash}${operator?.startAwaited && !crash ? "The mission waits for Start. " : ""}${sentences(whys)}`);
    disabledFor(part(confirm, "go"), isCutOff() ? "not connected" : lostFor() != null ? "not reachable" : "");
    plan.fill();
  };
}

/** `Take command first: Start, Pause. Nothing is paused: Resume.` */
function sentences(whys) {
  const byReason = new Map();
  whys.forEach((reason, index) => reason && byReason.set(reason, [...(byReason.get(reason) ?? []), VERBS[index].label.replace("…", "")]));
  const all = [...byReason].map(([reason, labels]) => `${capital(reason)}${labels.length === VERBS.filter(isShown).length ? "" : `: ${labels.join(", ")}`}.`);
  return all.join(" ");
}

function isShown(it) {
  return it.after?.(store.doc?.operator) ?? true;
}

/** Why an order cannot be given now; empty when it can. The gateway decides. */
function why(it) {
  if (isCutOff()) return "not connected";
  if (lostFor() != null) return `not reachable: no contact for ${age(lostFor())}`;
  if (!(it.safety && has("safety"))) {
    if (!has("operator")) return `needs the role operator${it.safety ? " or safety" : ""}`;
    if (!inCommand()) return "take command first";
  }
  if (it.after) return "";
  if (it.verb === "start" && store.doc?.operator?.uninspectedCrash) return "inspect the vehicle first";
  if (!store.doc?.mission?.phase) return "not known yet what is flown: the mission manager was not heard";
  if (store.doc?.mission?.phase === "MISSION_PHASE_OVER") {
    if (it.verb !== "start") return "the mission is over";
    return store.doc.operator?.startAwaited ? "" : "the mission is over: upload the next one first";
  }
  return it.when?.(store.doc?.operator) ?? "";
}

async function begin(it) {
  withdraw();
  if (it.place) {
    announce("", `${store.selected}: Choose the place on the map: click, or move the mark with the arrow keys and press Enter. Escape cancels.`);
    const place = await pickPlace();
    announce("", "");
    if (!place) return;
    const body = { position: { northM: place.north, eastM: place.east } };
    ask(`End the mission and land at N ${number(place.north)}, E ${number(place.east)}?`, it.label, (vehicle) => order(vehicle, it.verb, it.verb, body));
    return markPlace(place);
  }
  if (it.question) return ask(it.question, it.label, (vehicle) => order(vehicle, it.verb, it.verb));
  return order(store.selected, it.verb, it.verb);
}
