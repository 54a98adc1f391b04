// Two layouts of the page: an operator's (what is next, permissions, energy, alarms), and an engineer's, which has everything.

import { attribute, h } from "./dom.js";
import { renew } from "./store.js";

const LAYOUT = "kittiwake.layout";
const LAYOUTS = { operator: "Operator", engineer: "Engineer" };

/** The switch; which panels a layout leaves out says the style sheet. */
export function mountLayout() {
  const select = h("select", { "aria-label": "Layout", id: "layout", title: "The operator's layout leaves out tree, processes and timing" });
  for (const [value, label] of Object.entries(LAYOUTS)) select.append(h("option", { value }, label));
  const apply = () => attribute(document.documentElement, "data-layout", select.value);
  const kept = localStorage.getItem(LAYOUT);
  select.value = kept in LAYOUTS ? kept : "operator";
  select.addEventListener("change", () => {
    localStorage.setItem(LAYOUT, select.value);
    apply();
    // Canvases get another size.
    renew();
  });
  apply();
  return select;
}
