// @ts-check
/** JSON whose whole numbers keep all their digits: a seed has 64 bits, of which a number of JavaScript holds 53. */

const WHOLE = /^-?\d+$/;

/** Return the number that a text is: a BigInt where a number would lose digits, null if it is not a finite number. @param {string} text */
export function parseNumber(text) {
  const value = Number(text);
  if (!Number.isFinite(value)) return null;
  return WHOLE.test(text) && !Number.isSafeInteger(value) ? BigInt(text) : value;
}

/** Return a value as JSON. @param {unknown} value @param {number} [indent] */
export const stringify = (value, indent = undefined) =>
  JSON.stringify(value, (_, item) => (typeof item === "bigint" ? `\0${item}\0` : item), indent).replace(/"\\u0000(-?\d+)\\u0000"/g, "$1");

/** Return the value of a JSON text; a browser that does not tell how a number was written has the nearest one. @param {string} text */
export const parse = (text) => JSON.parse(text, reviveNumber);

/** @param {string} _ @param {unknown} item @param {{ source?: string }} [context] newer than the declarations of the language */
function reviveNumber(_, item, context) {
  return typeof item === "number" && context?.source ? parseNumber(context.source) ?? item : item;
}
