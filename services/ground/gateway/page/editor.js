// Another mission: its text, what it would need ("what if"), and its upload in place of the present one.

import * as api from "./api.js";
import { attribute, disabledFor, h, text } from "./dom.js";
import { changed, has, inCommand, isCutOff, store } from "./store.js";
import { missionText } from "./mission-text.js";
import { movedTo, placesIn } from "./draft.js";
import { forecast, mistakes } from "./forecast.js";
import { announce, ask, order } from "./orders.js";
import { showAll } from "./map-view.js";

export function mountEditor() {
  const panel = document.getElementById("editor");
  const area = h("textarea", { id: "mission-text", spellcheck: "false", autocomplete: "off", wrap: "off", "aria-label": "Text of the mission file", input: () => tried(null) });
  /** Moving a place on the map changes the text. */
  store.draft.move = (index, to) => {
    const place = placesIn(area.value)[index];
    if (!place) return;
    area.value = movedTo(area.value, place, to);
    area.setSelectionRange(place.from, place.from);
    tried(null);
  };
  const outcome = h("div", { class: "outcome", id: "what-if-outcome", role: "status" });
  const whatIf = h("button", { id: "what-if", "data-help": "What this mission would need from here; changes nothing", click: tryOut }, "What if");
  const upload = h("button", { id: "upload", class: "hazard", "data-help": "Replace the present mission with this one", click: put }, "Upload…");
  const again = h("button", { id: "mission-reload", "data-help": "Load the text of the present mission", click: load }, "Reload");
  const close = h("button", { id: "editor-close", click: () => edit(false) }, "Close");
  panel.querySelector(".body").append(
    h("div", { class: "buttons" }, whatIf, upload, again, close),
    area,
    outcome,
  );
  /** The vehicle whose mission this is, and the text that was found good. */
  let [vehicle, good] = [null, null];

  function tried(items, text = null) {
    store.whatIf = items;
    store.draft.places = placesIn(area.value);
    good = text;
    if (!items) outcome.replaceChildren();
    changed();
  }

  /** Whether an answer about the mission of `asked` still concerns what is edited. */
  const concerns = (asked) => store.editing && store.selected === asked;

  async function load() {
    const asked = store.selected;
    try {
      const mission = missionText(await api.get(`/api/v1/vehicles/${encodeURIComponent(asked)}/mission`));
      if (!concerns(asked)) return;
      area.value = mission;
      tried(null);
    } catch (refusal) {
      if (!(refusal instanceof api.Refusal)) throw refusal;
      if (concerns(asked)) announce("bad", `${asked}: The mission cannot be read: ${refusal.message}.`);
    }
  }

  async function tryOut() {
    const [asked, words] = [store.selected, area.value];
    try {
      const answer = await api.command("POST", `/api/v1/vehicles/${encodeURIComponent(asked)}/mission/validate`, { text: words });
      if (!concerns(asked) || area.value !== words) return;
      tried(answer.forecast, words);
      showAll();
      outcome.replaceChildren(forecast(answer.text, "good", answer.forecast));
    } catch (refusal) {
      if (!(refusal instanceof api.Refusal)) throw refusal;
      if (!concerns(asked) || area.value !== words) return;
      tried(refusal.document.forecast ?? []);
      const wrong = refusal.document.mistakes ?? [];
      outcome.replaceChildren(forecast(refusal.message, "bad", refusal.document.forecast ?? []), mistakes(wrong, area));
    }
  }

  function put() {
    const words = area.value;
    const flying = store.doc?.aircraft?.derived?.flying ? " It is in the air and starts it at once." : "";
    ask(`Replace ${store.doc?.mission?.name ?? "the present mission"} with this mission?${flying}`, "Upload", async (vehicle) => {
      const done = await order(vehicle, "upload", "mission", { text: words }, "PUT");
      if (done && concerns(vehicle)) edit(false);
    });
  }

  return () => {
    attribute(panel, "hidden", !store.editing);
    document.body.classList.toggle("editing", store.editing);
    if (store.editing && vehicle !== store.selected) {
      vehicle = store.selected;
      // Until its own mission is here, nothing of another vehicle's can be uploaded to it.
      area.value = "";
      tried(null);
      load();
    }
    if (!store.editing) [vehicle, store.draft.places] = [null, []];
    disabledFor(whatIf, isCutOff() ? "not connected" : has("operator") ? "" : "needs the role operator");
    disabledFor(upload, isCutOff() ? "not connected" : !has("operator") ? "needs the role operator" : !inCommand() ? "take command first" : good !== area.value ? "try out the mission first with What if" : "");
    disabledFor(again, isCutOff() ? "not connected" : "");
    text(panel.querySelector("h2"), `Another mission for ${store.selected ?? ""}`);
  };
}

/** Opens or closes the editor. */
export function edit(on) {
  Object.assign(store, { editing: on, whatIf: null });
  changed();
}
