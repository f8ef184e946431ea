import assert from "node:assert/strict";
import { test } from "node:test";
import { addressOf as comparisonAddress, comparisonOf, figureQuery, wholeNumber } from "../../api/dashboard/views/compare/address.js";
import { addressOf as listAddress, filtersOf, isFiltered } from "../../api/dashboard/views/list/filters.js";

const parametersOf = (address) => new URLSearchParams(address.split("?")[1] ?? "");

test("an address of a comparison says everything, and comes back as it was", () => {
  const address = "#/compare?experiments=b,a&x=time&cost_s=90&band=sd&fitness=transferred&each=true&test=welch&from=2&to=4&margin=0.03&margin_of_direct=0.1";
  assert.equal(comparisonAddress(comparisonOf(parametersOf(address))), address);
  const atCost = "#/compare?experiments=b,a&x=cost&cost_s=90&rollout_s=0.01&cores=8&attention=40&equal=true";
  assert.equal(comparisonAddress(comparisonOf(parametersOf(atCost))), atCost);
  assert.equal(comparisonAddress(comparisonOf(new URLSearchParams())), "#/compare");
  assert.equal(comparisonAddress(comparisonOf(new URLSearchParams("from=0&to=0"))), "#/compare?from=0&to=0");
});

test("what is wrong in an address of a comparison is as if it were left out", () => {
  const wrong = "experiments=a,a,../b,&studies=s&x=toString&cost_s=-1&band=constructor&fitness=best&each=yes&test=guess&from=x&to=99999&margin=0&margin_of_direct=wide";
  const { experiments, studies, ...others } = comparisonOf(new URLSearchParams(wrong));
  assert.deepEqual([experiments, studies], [["a"], ["s"]]);
  assert.deepEqual(others, { x: "evaluations", model: { cost_s: 60, rollout_s: null, cores: null, machine: null, attention: null, wear: null }, equal: false, band: "", fitness: "", each: false, test: "trusted", from: null, to: null, margin: null, margin_of_direct: null });
});

test("the figure is asked only for what differs from its defaults", () => {
  const choice = comparisonOf(new URLSearchParams("experiments=a"));
  assert.deepEqual(figureQuery(choice), { study: ["a"], x: null, band: "", fitness: "", each: null });
  assert.deepEqual(figureQuery({ ...choice, x: "time", each: true }), { study: ["a"], x: "time", cost_s: 60, rollout_s: null, cores: null, band: "", fitness: "", each: true });
  assert.deepEqual([wholeNumber("0"), wholeNumber(""), wholeNumber(null), wholeNumber("1.5")], [0, null, null, null]);
});

test("an address of the list holds its filters, and nothing that is usual", () => {
  const address = "#/?state=FAILED&strategy=random&text=a+b&sort=name";
  assert.equal(listAddress(filtersOf(parametersOf(address))), address);
  assert.equal(listAddress(filtersOf(new URLSearchParams())), "#/");
  assert.equal(filtersOf(new URLSearchParams("sort=strategy")).sort, "-created_at");
});

test("a list is filtered by state, strategy or words, and not by its order", () => {
  assert.equal(isFiltered(filtersOf(new URLSearchParams("sort=name"))), false);
  for (const filter of ["state=FAILED", "strategy=random", "text=a"]) assert.ok(isFiltered(filtersOf(new URLSearchParams(filter))));
});
