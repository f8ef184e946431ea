/** Fields of the form: each with its label, what it means, and room for what the service finds wrong with it. */

import { h } from "../../lib/dom.js";
import { spoken } from "../../lib/format.js";

let made = 0;

/** All places of a form that an error can stand at; `pointer()` of each says where its value is in the spec now. */
export class Places {
  constructor() {
    this.all = [];
  }

  /** Let `element` be the place of what is at the pointer; `trouble` shows what is wrong there. */
  add(pointer, element, trouble) {
    this.all.push({ pointer, element, trouble });
  }

  /** Show the errors beside their fields; returns those that have none. */
  show(errors) {
    const here = this.all.filter(({ element }) => element.isConnected);
    this.all = here;
    const found = new Map(here.map((each) => [each, []]));
    const others = errors.filter((error) => {
      const near = here.map((each) => [each, each.pointer()]).filter(([, pointer]) => within(error.pointer, pointer));
      near.sort(([, one], [, other]) => other.length - one.length);
      if (near.length) found.get(near[0][0]).push(error.message);
      return !near.length;
    });
    for (const [{ element, trouble }, messages] of found) {
      const words = messages.join(" ");
      if (trouble.textContent !== words) trouble.textContent = words;
      if (words) element.setAttribute("aria-invalid", "true");
      else element.removeAttribute("aria-invalid");
    }
    return others;
  }
}

const within = (pointer, place) => place !== null && (pointer === place || pointer.startsWith(`${place}/`));

/** Room for an error, and the id that a field refers to it by. */
export function troubleRoom() {
  return h("span", { class: "trouble", id: `trouble-${++made}`, "aria-live": "polite" });
}

/** A field: `{ label, hint, value, set, pointer, places, choices, ...attributes }`; with choices it is a list to choose from. */
export function field({ label, hint = "", value, set, pointer, places, choices = null, ...attributes }) {
  const trouble = troubleRoom();
  const id = `field-${made}`;
  const common = { id, "aria-describedby": `${trouble.id}${hint ? ` ${id}-hint` : ""}`, ...attributes };
  const input = choices
    ? h("select", { ...common, onchange: () => set(input.value) }, ...choices.map(([name, words, off]) => h("option", { value: name, disabled: off }, words)))
    : h("input", { autocomplete: "off", ...common, oninput: () => set(input.value) });
  input.value = value ?? "";
  places.add(typeof pointer === "function" ? pointer : () => pointer, input, trouble);
  return h("p", { class: "field" }, h("label", { for: id }, label), input,
    hint ? h("small", { id: `${id}-hint` }, hint) : null, trouble);
}

/** A number; it is a text field, so that what is no number can be said to be none. */
export const numberField = (options) => field({ inputmode: "decimal", ...options });

/** A box to tick, with its words. */
export function tickField(words, on, set, attributes = {}) {
  const box = h("input", { type: "checkbox", onchange: () => set(box.checked), ...attributes });
  box.checked = on;
  return h("label", { class: "tick" }, box, h("span", {}, words));
}

/** A field for each option of a plug-in, from their JSON Schema; `pointer()` is that of the plug-in. */
export function optionFields(plugin, options, pointer, { places, changed }) {
  const fields = Object.entries(plugin?.options.properties ?? {}).map(([name, schema]) => {
    const usual = schema.default === null || schema.default === undefined ? "" : String(schema.default);
    const set = (value) => {
      options[name] = value;
      changed();
    };
    if (schema.type === "boolean") return h("p", { class: "field" }, tickField(`${spoken(name)}: ${schema.description}`, options[name] ?? schema.default, set));
    const hint = schema.description ?? "";
    const choices = schema.enum ? [["", `${spoken(usual)}, as usual`], ...schema.enum.map((each) => [each, spoken(each)])] : null;
    const attributes = choices ? {} : { placeholder: usual, inputmode: "decimal" };
    const at = () => (pointer() === null ? null : `${pointer()}/options/${name}`);
    return field({ label: spoken(name), hint, value: options[name], set, places, choices, pointer: at, ...attributes });
  });
  return fields.length ? h("div", { class: "fields" }, ...fields) : null;
}
