// Says how old the shown data are, and marks every panel whose source is silent.

import { attribute, text } from "./dom.js";
import { age, flag } from "./words.js";
import { isSourceStale, isStale, silence, sourceAge, store } from "./store.js";

export function mountStaleness() {
  const alarm = document.getElementById("alarm");
  const banner = document.getElementById("staleness");
  const panels = [...document.querySelectorAll("[data-source]")];
  return () => {
    const stale = isStale();
    document.body.classList.toggle("stale", stale);
    for (const panel of panels) {
      attribute(panel, "data-stale", store.doc && isSourceStale(panel.dataset.source) ? "true" : "false");
    }
    attribute(banner, "hidden", !(stale || (store.doc && isSourceStale("introspection"))));
    text(banner, words(stale));
    const urgent = unacknowledged();
    attribute(alarm, "hidden", !urgent.length);
    text(alarm, urgent.length ? `Contingency: ${urgent.map((it) => flag(it.flag)).join(", ")}. Show` : "");
  };
}

/** Active contingencies that nobody has acknowledged: shown on top where their panel is out of sight. */
function unacknowledged() {
  return (store.doc?.contingencies?.active ?? []).filter((it) => !it.acknowledgedBy).sort((a, b) => a.priority - b.priority);
}

function words(stale) {
  if (store.signIn) return "Not signed in: no data.";
  if (!store.doc) return "No data yet.";
  if (stale) return `Connection lost. No data for ${age(silence())}: everything shown is stale.`;
  const monitor = sourceAge("introspection");
  return `No data from the vehicle's monitor for ${age(monitor)}: position, speed, battery and flags are stale.`;
}
