// @ts-check
/** What to do next, in large type: the request, what is expected of it, its motion, who has it, and the form for its answer. The others in a list. */

import { post, queryString } from "../../lib/api.js";
import { operatorName, REASON } from "../../lib/bench/corrections.js";
import { browserStore } from "../../lib/bench/outbox.js";
import { isMine, requestWords, stateText } from "../../lib/bench/requests.js";
import { copyButton } from "../../lib/copy.js";
import { openDialog } from "../../lib/dialog.js";
import { button, h, tellingErrors } from "../../lib/dom.js";
import { downloadLink } from "../../lib/downloads.js";
import { count, readableName } from "../../lib/format.js";
import { ageOf } from "../../lib/live.js";
import { empty } from "../../lib/placeholders.js";
import { answerForm } from "./answer_form.js";

const MOTIONS = [["csv", "CSV", "csv"], ["json", "JSON", "json"], ["ros2", "ROS 2", "yaml"]];

/**
 * Return that nothing is asked now.
 * @param {{ bench: string | null, experiment: string | null }} query
 * @param {boolean} isWaiting whether an answer waits to be sent
 */
export function nothingToDo({ bench, experiment }, isWaiting) {
  const all = bench || experiment ? h("a", { class: "button quiet", href: "#/bench" }, "Show all benches") : h("a", { class: "button quiet", href: "#/" }, "To the studies");
  const text = isWaiting ? "Nothing else is asked until your answer is stored." : "Nothing is to be measured now. This page shows the next request by itself.";
  return h("div", { class: "card" }, empty(text, all));
}

/** Return the card of a request. @param {Api.RequestRead} request @param {Page.BenchView} view */
export function nextCard(request, view) {
  const { robot, bench, repeats, unit, experiment, experiment_name: name } = request;
  const values = `${repeats === 1 ? "1 value" : `${count(repeats)} repeats`}${unit ? ` in ${unit}` : ""}`;
  return h("section", { class: "card next", "aria-labelledby": "next-title" },
    h("p", { class: "kicker" }, bench === robot ? "Measure next" : `Measure next on ${bench}`),
    h("h2", { id: "next-title", tabindex: "-1" }, `${readableName(robot)}: ${request.kind} of iteration ${request.iteration}`),
    h("p", { class: "large" }, `Repetition ${request.repetition} · `, h("strong", {}, values)),
    h("p", { class: "note" }, h("a", { href: `#/experiments/${experiment}` }, name), " · asked ", ageOf(request.created_at)),
    advice(request), files(request, view), holder(request, view));
}

/** @param {Api.RequestRead} request */
function advice({ safety, expected, between_repeats: between, needs }) {
  const list = (/** @type {string[]} */ lines, attributes = {}) => h("ul", attributes, ...lines.map((line) => h("li", {}, line)));
  return [
    needs ? h("p", { class: "remark warned" }, needs) : null,
    safety?.beyond.length ? h("div", { class: "remark broken" }, h("strong", {}, "Beyond the limits of the robot"), list(safety.beyond)) : null,
    safety ? list([...expected, ...safety.unknown], { class: "expected", "aria-label": "What simulators expect" }) : null,
    between ? h("p", { class: "note" }, between) : null,
  ];
}

/** Return the motion to save, the replay in the simulators, and the genome. @param {Api.RequestRead} request @param {Page.BenchView} view */
function files(request, { functions }) {
  const { id, experiment, repetition, iteration, kind, genome } = request;
  const query = queryString({ experiment, repetition, iteration, kind: kind === "sample" ? "sample" : "transfer" });
  const links = MOTIONS.flatMap(([format, label, ending]) =>
    [downloadLink(label, `/requests/${id}/motion`, { format }, `motion-${id}.${ending}`, "Writing the motion"), " "]);
  const text = genome.join(", ");
  const shown = h("details", { class: "genome" }, h("summary", {}, `Genome: ${genome.length === 1 ? "1 gene" : `${genome.length} genes`}`),
    h("p", {}, h("code", {}, text)), copyButton("Copy the genome", () => JSON.stringify(genome)));
  if (functions.has(request.robot)) return [h("p", { class: "files large" }, "Run the controller with ", h("strong", {}, text)), shown];
  return [h("p", { class: "files large" }, "Motion: ", ...links), h("p", { class: "files" }, h("a", { href: `#/replay${query}` }, "Watch what the simulator expects")), shown];
}

/** Return who has the request, what can be done about that, and the form. @param {Api.RequestRead} request @param {Page.BenchView} view */
function holder(request, view) {
  const { id, state, taken_by: by, unanswered } = request;
  const form = answerForm(request, view);
  const failure = h("p", { class: "failed", role: "alert" });
  const press = (/** @type {() => Promise<void>} */ act) => tellingErrors(failure)(async () => {
    await act();
    view.refresh();
  });
  if (isMine(request, view.take.holding)) {
    return [h("p", { class: "held" }, `You have it, as ${by}. `, button("Give it back", press(() => view.take.release()))), failure, form];
  }
  if (state === "taken") {
    const end = () => openDialog({
      title: `End the take of ${by}?`, text: "The request is open again. An answer that still comes is kept, and a person decides which one counts.",
      fields: [{ name: "operator", label: "Your name", value: operatorName(), required: true, maxlength: 200 }, REASON], action: "End it",
      act: async (given) => {
        await post(`/requests/${id}/release`, { take: request.takes, ...given });
        browserStore("operator").write("name", given.operator);
        view.refresh();
      },
    }, view.signal);
    return [h("p", { class: "remark warned" }, `${by} has taken it until ${timeOf(request)}. `, button("End that take…", end)),
      h("details", {}, h("summary", {}, "Answer it all the same"), h("p", { class: "note" }, "A person then decides which answer counts."), form)];
  }
  if (state === "stuck") {
    const again = async () => { await post(`/requests/${id}/reopen`); };
    return [h("p", { class: "remark warned" }, `It was taken ${unanswered} times in a row without an answer. Look at the robot and its driver first.`),
      button("Open it again", press(again), { class: "big" }), failure];
  }
  return [takeForm(request, view, failure, press), failure, h("details", { open: !request.busy }, h("summary", {}, "Answer without taking it"), form)];
}

/**
 * Return the name of the operator, and the button that takes the request.
 * @param {Api.RequestRead} request
 * @param {Page.BenchView} view
 * @param {HTMLElement} failure
 * @param {(act: () => Promise<void>) => () => Promise<void>} press
 */
function takeForm(request, view, failure, press) {
  const name = h("input", { id: "operator", autocomplete: "name", maxlength: 200, required: true });
  name.value = operatorName();
  const take = press(() => view.take.take(request.id, name.value.trim()));
  const submit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    if (name.value.trim()) {
      browserStore("operator").write("name", name.value.trim());
      take();
    } else failure.textContent = "Enter your name: it is stored with the measurement.";
  };
  return h("form", { class: "take", onsubmit: submit },
    request.busy ? h("p", { class: "remark warned" }, "Another request of this bench is taken now; one is taken at a time.") : null,
    h("p", { class: "field" }, h("label", { for: "operator" }, "Your name"), name), h("button", { type: "submit", class: "big" }, "Take it"));
}

/** @param {Api.RequestRead} request */
const timeOf = ({ taken_until: until }) => (until ? new Date(until).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" }) : "later");

/** Return the list; nothing if there are none. @param {Api.RequestRead[]} requests @param {Page.BenchView} view */
export function otherList(requests, view) {
  if (!requests.length) return null;
  return h("section", { class: "card others", "aria-labelledby": "others-title" }, h("h2", { id: "others-title" }, "Others that wait"),
    h("ul", { class: "rows" }, ...requests.map((request) => row(request, view))));
}

/** @param {Api.RequestRead} request @param {Page.BenchView} view */
function row(request, view) {
  const { id, robot, bench, experiment, experiment_name: name } = request;
  const words = `${readableName(robot)}${bench === robot ? "" : ` (${bench})`}, ${requestWords(request)}`;
  return h("li", { class: request.state }, h("strong", {}, words), h("span", { class: "note" }, h("a", { href: `#/experiments/${experiment}` }, name), " · asked ", ageOf(request.created_at)),
    h("span", {}, stateText(request), " ", button("Show", () => view.choose(id), { "aria-label": `Show ${words}` })));
}
