// The objectives in order; while the mission is edited, with buttons for each.

import { attribute, disabledFor, h, list, part, text } from "./dom.js";
import { inCommand, isCutOff, store } from "./store.js";
import { number, objective, sentence } from "./words.js";
import { ask, order } from "./orders.js";

const GLYPHS = { SUCCESS: "✓", FAILURE: "✕", WAITING: "○" };
const TONES = { SUCCESS: "good", FAILURE: "bad" };

export function objectives() {
  const element = h("ol", { class: "objectives" });
  const fill = () => {
    const mission = store.doc?.mission;
    const rows = (mission?.objectives ?? []).map((it, index) => ({ ...it, index, present: index === mission.currentObjective }));
    list(element, rows, (it) => it.name, make, renew);
  };
  return { element, fill };
}

function make({ name }) {
  const path = `mission/objectives/${encodeURIComponent(name)}`;
  const skip = () => ask(`Skip objective ${name}? It counts as failed.`, "Skip", (vehicle) => order(vehicle, `skip ${name}`, `${path}/skip`));
  const remove = () => ask(`Remove objective ${name} from the mission?`, "Remove", (vehicle) => order(vehicle, `remove ${name}`, path, undefined, "DELETE"));
  return h(
    "li",
    { "data-objective": name },
    h("span", { class: "glyph", "data-part": "glyph", "aria-hidden": "true" }),
    h("div", {}, h("strong", { "data-part": "name" }), h("span", { class: "muted", "data-part": "place" }), h("span", { class: "reason", "data-part": "reason" })),
    h("span", { class: "muted", "data-part": "state" }),
    h("div", { class: "buttons", "data-part": "edit", hidden: true },
      h("button", { "data-part": "skip", "data-help": "Skip it: it counts as failed", "aria-label": `Skip ${name}`, click: skip }, "Skip"),
      h("button", { "data-part": "remove", "data-help": "Remove it from the mission", "aria-label": `Remove ${name}`, click: remove }, "Remove"),
    ),
  );
}

function renew(row, it) {
  const key = it.state.replace("OBJECTIVE_STATE_", "");
  const { northM = 0, eastM = 0, downM = 0 } = it.position ?? {};
  text(part(row, "glyph"), it.present && key === "WAITING" ? "▸" : (GLYPHS[key] ?? "○"));
  text(part(row, "name"), it.name);
  const height = it.flying ? `, ${number(-downM)} m high${it.drop ? ", drops its load" : ""}` : `, on the ground${it.landOnTarget ? ", on a target" : ""}`;
  text(part(row, "place"), `N ${number(northM)}, E ${number(eastM)}${height}`);
  text(part(row, "state"), it.present && key === "WAITING" ? "current" : objective(it.state));
  text(part(row, "reason"), it.reason ? sentence(it.reason) : it.replans ? `Replanned ${it.replans === 1 ? "once" : `${it.replans} times`}.` : "");
  attribute(row, "data-tone", TONES[key] ?? (it.present ? "accent" : null));
  attribute(part(row, "edit"), "hidden", !store.editing || key !== "WAITING");
  const reason = isCutOff() ? "not connected" : inCommand() ? "" : "take command first";
  disabledFor(part(row, "skip"), reason);
  disabledFor(part(row, "remove"), reason);
}
