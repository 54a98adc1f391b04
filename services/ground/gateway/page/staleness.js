// Says how old what is shown is, and marks every panel whose source is silent.

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
    text(alarm, urgent.length ? `${urgent.map((it) => flag(it.flag)).join(", ")}: to the contingencies` : "");
  };
}

/** What acts or waits and nobody has acknowledged: said on top where the panel is out of sight. */
function unacknowledged() {
  return (store.doc?.contingencies?.active ?? []).filter((it) => !it.acknowledgedBy).sort((a, b) => a.priority - b.priority);
}

function words(stale) {
  if (store.signIn) return "Not signed in: nothing is received.";
  if (!store.doc) return "Nothing received yet.";
  if (stale) return `Connection lost. Nothing received for ${Math.floor(silence())} s; everything shown is from then.`;
  const monitor = sourceAge("introspection");
  return `The vehicle's monitor is silent (${age(monitor)}): position, speed, battery and flags are from then.`;
}
