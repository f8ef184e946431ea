// @ts-check
/** Fields of the form: each with its label, its meaning, and room for the service's errors. */

import { h, select, setText } from "../../lib/dom.js";
import { readableName } from "../../lib/format.js";

/** @typedef {import("../new.js").Form} Form */
/** @typedef {() => string | null} Pointer where a value stands in the spec now; null if it is not in it */
/** @typedef {{ pointer: Pointer, element: Element, room: HTMLElement }} Place */
/** @typedef {{ pointer: string, message: string }} FieldError */

const MOST_MESSAGES = 5;  // a table of samples may have thousands of errors

let rooms = 0;

/** The places of a form at which an error can stand. */
export class ErrorPlaces {
  constructor() {
    /** @type {Place[]} */
    this.places = [];
  }

  /**
   * Let errors of the value at a pointer mark an element and be shown in a room.
   * @param {Pointer} pointer
   * @param {Element} element
   * @param {HTMLElement} room
   */
  add(pointer, element, room) {
    this.places.push({ pointer, element, room });
  }

  /** Show errors at their nearest places, and return those that have none. @param {FieldError[]} errors */
  show(errors) {
    this.places = this.places.filter(({ element }) => element.isConnected);
    const pointers = this.places.map(({ pointer }) => pointer());
    const nearest = errors.map((error) => nearestPlace(error.pointer, pointers));
    this.places.forEach(({ element, room }, index) => {
      const messages = errors.filter((_, error) => nearest[error] === index).map(({ message }) => message);
      const rest = messages.length - MOST_MESSAGES;
      setText(room, [...messages.slice(0, MOST_MESSAGES), ...(rest > 0 ? [`and ${rest} more errors`] : [])].join(" "));
      if (messages.length) {
        element.setAttribute("aria-invalid", "true");
        for (let around = element.closest("details"); around; around = around.parentElement?.closest("details") ?? null) around.open = true;
      }
      else element.removeAttribute("aria-invalid");
    });
    return errors.filter((_, error) => nearest[error] === -1);
  }
}

/** Return the index of the longest place that contains a pointer, or -1. @param {string} pointer @param {(string | null)[]} places */
export function nearestPlace(pointer, places) {
  let nearest = -1;
  places.forEach((place, index) => {
    if (place === null || (pointer !== place && !pointer.startsWith(`${place}/`))) return;
    if (nearest === -1 || place.length > (places[nearest] ?? "").length) nearest = index;
  });
  return nearest;
}

/** Return room for an error, whose id a field can refer to. */
export function errorRoom() {
  return h("span", { class: "trouble", id: `trouble-${++rooms}`, "aria-live": "polite" });
}

/**
 * @typedef {object} FieldOptions
 * @property {string} label
 * @property {string} [hint]
 * @property {any} value
 * @property {(value: string) => void} set
 * @property {Pointer | string} pointer
 * @property {ErrorPlaces} places
 * @property {Page.Choices | null} [choices] makes the field a list to choose from
 */

/** Return a field; other options are attributes of its input. @param {FieldOptions & Page.Attributes} options */
export function field({ label, hint = "", value, set, pointer, places, choices = null, ...attributes }) {
  const room = errorRoom();
  const id = `field-${rooms}`;
  const common = { id, "aria-describedby": `${room.id}${hint ? ` ${id}-hint` : ""}`, ...attributes };
  const input = choices
    ? select(choices, { ...common, onchange: () => { set(input.value); } })
    : h("input", { autocomplete: "off", ...common, oninput: () => { set(input.value); } });
  input.value = String(value ?? "");
  places.add(typeof pointer === "function" ? pointer : () => pointer, input, room);
  return h("p", { class: "field" }, h("label", { for: id }, label), input,
    hint ? h("small", { id: `${id}-hint` }, hint) : null, room);
}

/**
 * Return a field for a number. It takes any text, so that the service can say what is wrong with it.
 * @param {FieldOptions & Page.Attributes} options
 */
export const numberField = (options) => field({ inputmode: "decimal", ...options });

/** Return a box to tick, with its label. @param {Page.Child} label @param {boolean} isOn @param {(isOn: boolean) => void} set */
export function tickField(label, isOn, set) {
  const box = h("input", { type: "checkbox", onchange: () => { set(box.checked); } });
  box.checked = isOn;
  return { box, element: h("label", { class: "tick" }, box, h("span", {}, label)) };
}

/**
 * Return fields for the options of a plug-in, made from their JSON Schema; null if it has none.
 * @param {Api.PluginRead | undefined} plugin
 * @param {Page.PluginDraft} draft
 * @param {Pointer} pointer of the plug-in
 * @param {Pick<Form, "places" | "changed" | "remake">} form
 */
export function optionFields(plugin, draft, pointer, { places, changed, remake }) {
  const { options } = draft;
  const presets = plugin?.presets ?? {};
  const preset = presets[draft.preset] ?? {};
  const schemas = /** @type {Record<string, any>} */ (plugin?.options.properties ?? {});
  const fields = Object.entries(schemas).map(([name, schema]) => {
    const set = (/** @type {unknown} */ value) => {
      options[name] = value;
      changed();
    };
    const label = readableName(name);
    if (schema.type === "boolean") return h("p", { class: "field" }, tickField(`${label}: ${schema.description}`, options[name] ?? preset[name] ?? schema.default, set).element);
    const usual = String(preset[name] ?? schema.default ?? "");
    const values = /** @type {string[] | undefined} */ (schema.enum);
    /** @type {Page.Choices | null} */
    const choices = values ? [["", `${readableName(usual)}, the default`], ...values.map((value) => /** @type {[string, string]} */ ([value, readableName(value)]))] : null;
    const attributes = choices ? {} : { placeholder: usual, inputmode: "decimal" };
    const optionPointer = () => (pointer() === null ? null : `${pointer()}/options/${name}`);
    return field({ label, hint: schema.description, value: options[name], set, places, choices, pointer: optionPointer, ...attributes });
  });
  const choose = (/** @type {string} */ name) => {
    Object.assign(draft, { preset: name, options: {} });
    remake();
  };
  const names = Object.keys(presets);
  if (names.length) {
    fields.unshift(field({ label: "Preset", hint: "sets the options below, which you can change", value: draft.preset, set: choose, places,
      pointer: () => (pointer() === null ? null : `${pointer()}/preset`), choices: [["", "The defaults"], ...names.map((name) => /** @type {[string, string]} */ ([name, readableName(name)]))] }));
  }
  return fields.length ? h("div", { class: "fields" }, ...fields) : null;
}

/** Return what can be unfolded; it stays so while the form is made again. @type {(id: string, title: Page.Child, content: Page.Child[], open?: boolean) => HTMLElement} */
export const folded = (id, title, content, open = false) => h("details", { open, dataset: { id } }, h("summary", {}, title), ...content);

/**
 * Return a list of plug-ins to choose from, and the options of the chosen one. Unavailable plug-ins say why, and how to get them.
 * @param {Form} form
 * @param {string} label
 * @param {Page.PluginDraft} draft
 * @param {Api.PluginRead[]} plugins
 * @param {string} pointer
 * @param {string | null} [none] label of the choice of none
 */
export function pluginField(form, label, draft, plugins, pointer, none = null) {
  const chosen = plugins.find(({ name }) => name === draft.name);
  /** @type {Page.Choices} */
  const choices = plugins.map(({ name, available }) => [name, `${readableName(name)}${available ? "" : ": not available"}`, !available]);
  const set = (/** @type {string} */ name) => {
    Object.assign(draft, { name, preset: "", options: {} });
    form.remake();
  };
  const options = optionFields(chosen, draft, () => pointer, form);
  return [
    field({ label, hint: chosen?.summary, value: draft.name, set, pointer, places: form.places, choices: none === null ? choices : [["", none], ...choices] }),
    ...plugins.map(whyUnavailable),
    options ? folded(pointer, `Options of ${readableName(draft.name)}`, [options], draft.preset !== "" || Object.keys(draft.options).length > 0) : null];
}

/** Return why a plug-in is unavailable; null if it is not. @param {Api.PluginRead | undefined} plugin */
export function whyUnavailable(plugin) {
  return plugin === undefined || plugin.available ? null
    : h("p", { class: "note" }, `${readableName(plugin.name)} is not available: `, h("code", {}, plugin.note));
}
