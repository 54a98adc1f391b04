// Says how old the shown data are, and marks every panel whose source is silent.

import { attribute, text } from "./dom.js";
import { age } from "./words.js";
import { isSourceStale, isStale, lostFor, silence, sourceAge, store } from "./store.js";

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

/** What a vehicle in flight does by itself when it does not hear the ground. */
function byItself() {
  const responses = (store.session?.withoutContact ?? []).map((it) => `${it.response} after ${age(it.afterS)}`);
  return responses.length ? `In flight, without contact, it ${responses.join(" and ")}.` : "";
}

function words(stale) {
  if (store.signIn) return "Not signed in: no data.";
  if (!store.doc) return "No data yet.";
  if (stale) return `Connection lost. No data for ${age(silence())}: everything shown is stale.`;
  if (lostFor() != null) return `No contact with ${store.selected} for ${age(lostFor())}: everything shown is that old. ${byItself()}`;
  const monitor = sourceAge("introspection");
  return `No data from the vehicle's monitor for ${age(monitor)}: position, speed, battery and flags are stale.`;
}
