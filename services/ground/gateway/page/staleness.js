// Says how old what is shown is, and marks every panel whose source is silent.

import { attribute, text } from "./dom.js";
import { age } from "./words.js";
import { isSourceStale, isStale, silence, sourceAge, store } from "./store.js";

export function mountStaleness() {
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
  };
}

function words(stale) {
  if (store.signIn) return "Not signed in: nothing is received.";
  if (!store.doc) return "Nothing received yet.";
  if (stale) return `Connection lost. Nothing received for ${Math.floor(silence())} s; everything shown is from then.`;
  const monitor = sourceAge("introspection");
  return `The vehicle's monitor is silent (${age(monitor)}): position, speed, battery and flags are from then.`;
}
