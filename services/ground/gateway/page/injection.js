// Trouble by a button, and flags and faults by hand: only where the vehicle is simulated, and for roles that may inject.

import * as api from "./api.js";
import { attribute, disabledFor, h, text } from "./dom.js";
import { has, isCutOff, store } from "./store.js";
import { flag } from "./words.js";
import { order } from "./orders.js";

/** For a first flight: what the button says, the fault and its arguments. */
const TROUBLES = [["Battery 20 %", "battery", ["0.2"]], ["Storm", "wind", ["15", "0", "3"]], ["Aircraft ahead", "head_on", ["400", "20"]]];

const mayInject = () => store.session?.simulation && (has("operator") || has("safety"));

export function mountTrouble() {
  const panel = document.getElementById("trouble");
  const buttons = TROUBLES.map(([label, name, args]) =>
    h("button", { "data-trouble": name, click: () => order(store.selected, "fault", "simulation/faults", { name, args }) }, label));
  panel.querySelector(".body").append(...buttons);
  return () => {
    attribute(panel, "hidden", !mayInject());
    for (const it of buttons) disabledFor(it, isCutOff() ? "not connected" : "");
  };
}

export function mountInjection() {
  const panel = document.getElementById("injection");
  const flags = h("select", { id: "inject-flag", "aria-label": "Flag" });
  const inject = (raised) => () => order(store.selected, "flag", "simulation/flags", { name: flags.value, raised, reason: `by hand, ${store.session?.name}` });
  const raise = h("button", { id: "inject-raise", click: inject(true) }, "Raise");
  const clear = h("button", { id: "inject-clear", click: inject(false) }, "Clear");
  const faults = h("select", { id: "inject-fault", "aria-label": "Fault", change: describe });
  const words = h("input", { id: "inject-args", "aria-label": "Arguments of the fault", autocomplete: "off" });
  const effect = h("p", { class: "muted", id: "inject-effect" });
  const go = h("button", { id: "inject-go" }, "Inject");
  const form = h("form", { submit: (event) => {
    event.preventDefault();
    order(store.selected, "fault", "simulation/faults", { name: faults.value, args: words.value.split(/\s+/).filter(Boolean) });
  } }, h("div", { class: "fields" }, faults, words, go), effect);
  panel.querySelector(".body").append(h("div", { class: "fields" }, flags, raise, clear), form);
  /** The faults of a vehicle's simulator. */
  let [vehicle, known] = [null, []];

  function describe() {
    const it = known.find((it) => it.name === faults.value);
    words.value = "";
    attribute(words, "placeholder", it?.arguments || "no arguments");
    attribute(words, "title", it?.arguments || null);
    text(effect, it?.effect ?? "");
  }

  async function ask() {
    const asked = store.selected;
    vehicle = asked;
    try {
      const { faults } = await api.get(`/api/v1/vehicles/${encodeURIComponent(asked)}/simulation/faults`);
      if (vehicle === asked) known = faults;
    } catch (refusal) {
      if (!(refusal instanceof api.Refusal)) throw refusal;
      // The simulator does not answer: the page asks again when the panel is opened again.
      if (vehicle === asked) [vehicle, known] = [null, []];
    }
    fillOptions(faults, known.map((it) => it.name), (it) => it);
    describe();
  }

  panel.addEventListener("toggle", () => panel.open && vehicle !== store.selected && ask());
  return () => {
    attribute(panel, "hidden", !mayInject());
    if (panel.open && vehicle && vehicle !== store.selected) ask();
    fillOptions(flags, store.session?.flags ?? [], flag);
    for (const it of [raise, clear]) disabledFor(it, isCutOff() ? "not connected" : flags.value ? "" : "no flag is known");
    disabledFor(go, isCutOff() ? "not connected" : faults.value ? "" : "no fault is known");
  };
}

function fillOptions(select, values, words) {
  if (select.dataset.values === values.join()) return;
  const chosen = select.value;
  select.replaceChildren(...values.map((value) => h("option", { value }, words(value))));
  if (values.includes(chosen)) select.value = chosen;
  select.dataset.values = values.join();
}
