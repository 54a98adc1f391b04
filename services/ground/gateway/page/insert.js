// A new objective: its name, its place by hand or on the map, and before which other objective.

import { attribute, disabledFor, h } from "./dom.js";
import { inCommand, isCutOff, store } from "./store.js";
import { pickPlace } from "./map-input.js";
import { announce, order } from "./orders.js";

export function insertForm() {
  const metres = (id, label) => h("input", { id, type: "number", step: "any", value: "0", required: true, "aria-label": label });
  const name = h("input", { id: "insert-name", placeholder: "Name", "aria-label": "Name of the objective", maxlength: 100, required: true, autocomplete: "off" });
  const [north, east, height] = [metres("insert-north", "Metres north"), metres("insert-east", "Metres east"), metres("insert-height", "Metres high")];
  const flying = h("input", { id: "insert-flying", type: "checkbox" });
  const before = h("select", { id: "insert-before", "aria-label": "Where in the mission" });
  const pick = h("button", { type: "button", id: "insert-pick", click: choose }, "On the map…");
  const insert = h("button", { id: "insert", class: "primary" }, "Insert");
  const element = h("form", { class: "insert", id: "insert-form", hidden: true, submit: onSubmit },
    h("h3", {}, "Insert an objective"),
    name,
    h("div", { class: "fields" }, h("label", {}, "N ", north), h("label", {}, "E ", east), h("label", {}, "Up ", height)),
    h("div", { class: "buttons" }, pick, h("label", {}, flying, " in the air")),
    h("div", { class: "buttons" }, before, insert),
  );

  async function choose() {
    announce("", "Choose the place on the map: click, or move the mark with the arrow keys and press Enter. Escape cancels.");
    const place = await pickPlace();
    announce("", "");
    if (!place) return;
    [north.value, east.value] = [place.north.toFixed(1), place.east.toFixed(1)];
    pick.focus();
  }

  async function onSubmit(event) {
    event.preventDefault();
    const position = { northM: Number(north.value), eastM: Number(east.value), downM: -Number(height.value) };
    const objective = { name: name.value.trim(), position, flying: flying.checked };
    if (await order(store.selected, "insert", "mission/objectives", { index: Number(before.value), objective })) name.value = "";
  }

  const fill = () => {
    attribute(element, "hidden", !store.editing);
    places(before);
    disabledFor(insert, isCutOff() ? "not connected" : inCommand() ? "" : "take command first");
  };
  return { element, fill };
}

/** An objective is not inserted before a settled one. */
function places(select) {
  const objectives = store.doc?.mission?.objectives ?? [];
  const first = store.doc?.mission?.currentObjective ?? 0;
  const options = objectives.map((it, index) => [index, `before ${it.name}`]).slice(first);
  options.push([objectives.length, "at the end"]);
  const words = options.map(([, it]) => it).join();
  if (select.dataset.words === words) return;
  const chosen = select.selectedOptions[0]?.textContent;
  select.replaceChildren(...options.map(([value, it]) => h("option", { value }, it)));
  const again = [...select.options].find((it) => it.textContent === chosen) ?? select.options[select.options.length - 1];
  select.value = again.value;
  select.dataset.words = words;
}
