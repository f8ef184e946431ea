/** JSON whose whole numbers keep all their digits: a seed has 64 bits, of which a number of JavaScript holds 53. */

const WHOLE = /^-?\d+$/;

/** A number that a text is, as a BigInt where a number would be another; what is none or infinite is nothing. */
export function numberOf(text) {
  const found = Number(text);
  if (!Number.isFinite(found)) return null;
  return WHOLE.test(text) && !Number.isSafeInteger(found) ? BigInt(text) : found;
}

/** The value as text. */
export const written = (value, indent = undefined) =>
  JSON.stringify(value, (_, each) => (typeof each === "bigint" ? `\0${each}\0` : each), indent).replace(/"\\u0000(-?\d+)\\u0000"/g, "$1");

/** The text as a value; a browser that does not tell how a number was written has the nearest. */
export const read = (text) =>
  JSON.parse(text, (_, each, context) => (typeof each === "number" && context?.source ? numberOf(context.source) ?? each : each));
