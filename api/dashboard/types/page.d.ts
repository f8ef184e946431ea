/* Types that the page's scripts share; the JSON of the service is declared in api.d.ts. */

declare namespace Page {
  /** What `h` takes as content; null, undefined and false are left out. */
  type Child = Node | string | number | boolean | null | undefined | Child[];

  interface Attributes {
    onclick?: (event: MouseEvent) => unknown;
    onmousedown?: (event: MouseEvent) => unknown;
    onkeydown?: (event: KeyboardEvent) => unknown;
    onsubmit?: (event: SubmitEvent) => unknown;
    dataset?: Record<string, string | number>;
    [name: string]: unknown;
  }

  type QueryValue = string | number | boolean | null | undefined;
  type Query = Record<string, QueryValue | QueryValue[]>;

  /** An answer with the tag that a later change of the same thing must name. */
  interface Tagged<Value> {
    value: Value;
    tag: string | null;
  }

  interface ServerEvent {
    kind: string;
    id: string | null;
    data: Api.EventRead;
  }

  /** An element with a function that brings it up to date. */
  interface Updatable<Value = void> {
    element: HTMLElement;
    update: (value: Value) => void;
  }

  /** What a list has to choose from. */
  type Choices = [value: string, label: string, disabled?: boolean][];

  /** A name as the API takes it: a plug-in without options is its bare name. */
  type PluginName = string | { name: string; preset?: string; options?: Record<string, any> };

  /** How loading ended: it failed and an earlier answer stands, the service still computes, or neither. */
  type Loaded = "failed" | "pending" | void;

  interface Sections {
    add(element: HTMLElement, kinds: string[] | null, load: () => Promise<Loaded>): () => void;
    reload(events: ServerEvent[]): void;
  }

  /** What the parts of the view of a study, or of one of its experiments, share. */
  interface StudyPage {
    /** The id in the address. */
    id: string;
    signal: AbortSignal;
    /** The number of the latest event when the page was loaded. */
    latest: number;
    study: Api.StudyRead;
    /** The first experiment, and often the only one. */
    readonly experiment: Api.ExperimentRead;
    tag: string | null;
    /** The robot of its experiments, as the catalogue has it. */
    robot: Api.PluginRead | undefined;
    isFunction: boolean;
    unit(experiment: Api.ExperimentRead | undefined): string;
    sections: Sections;
    take(tagged: Tagged<any>): void;
    reload(): Promise<void>;
    update(): void;
  }

  /** What the parts of the view of a bench share. */
  interface BenchView {
    signal: AbortSignal;
    /** Robots that are functions and have no motion. */
    functions: Set<string>;
    requests: Api.RequestRead[];
    conflicts: Api.RequestRead[];
    chosen: string | null;
    form: { id: string; element: HTMLFormElement } | null;
    take: import("../views/bench/take.js").Take;
    choose(id: string): void;
    answered(id: string): void;
    refresh(): void;
  }

  /** What the address of a comparison says. */
  interface Comparison {
    experiments: string[];
    x: string;
    /** What an axis of time or cost needs to know; null is the service's default. */
    model: Record<string, number | null>;
    /** Whether pairs are tested at equal rollouts, time or cost. */
    equal: boolean;
    band: string;
    fitness: string;
    each: boolean;
    test: "trusted" | "student" | "welch" | "mann_whitney" | "paired_t" | "wilcoxon" | "brown_forsythe";
    from: number | null;
    to: number | null;
    margin: number | null;
    margin_of_direct: number | null;
  }

  interface CompareView {
    choice: Comparison;
    cache: ReturnType<typeof import("../views/compare/cache.js").experimentCache>;
    signal: AbortSignal;
    sections: Sections;
    change(changes: Partial<Comparison>): Promise<void>;
  }

  /** The first and the last number of real-world evaluations. */
  type Range = [number, number];

  interface RangeResult {
    range: Range;
    pairs: Api.Comparison[];
  }

  /** A plug-in in the form for a new study; `on` is whether it is ticked. */
  interface PluginDraft {
    name: string;
    /** Name of the preset of the options that are left out; empty for the defaults. */
    preset: string;
    options: Record<string, any>;
    on?: boolean;
  }

  interface TunableDraft {
    name: string;
    on: boolean;
    lower: string | number;
    upper: string | number;
  }

  /** A physical reality in the form; what a simulated one has not is kept while the reader changes the kind. */
  interface BenchDraft {
    isPhysical: boolean;
    isRecorded: boolean;
    pool: string;
    heldOut: string | number;
    bench: string;
    repeats: string | number;
    probes: string;
    samples: Pick<Api.KnownSample, "genome" | "values">[];
    limits: Record<string, any>;
    beyond: string;
  }

  /** The content of the form for a new study; the empty text stands for a value that is left out. */
  interface Draft {
    [count: string]: any;
    name: string;
    strategies: PluginDraft[];
    robot: PluginDraft;
    controller: PluginDraft;
    task: PluginDraft;
    engine: PluginDraft;
    optimizer: PluginDraft;
    controllerOptimizer: PluginDraft;
    discrepancy: PluginDraft;
    tuner: PluginDraft;
    tunables: TunableDraft[];
    /** The robot that the tunables were ticked for. */
    tunablesOf: string;
    realityEngine: PluginDraft;
    realityParameters: Record<string, any>;
    realityNoise: Record<string, any>;
    bench: BenchDraft;
    budget: { [evaluations: string]: any; preset: string; reuse_transfer: boolean };
  }

  /** Which controller is replayed: the query of `/experiments/{id}/replay`. */
  type ReplayChoice = {
    experiment: string;
    repetition: number;
    iteration: number;
    kind: string;
    simulator: number | string | null;
  };

  /** What draws a robot: in a replay, or as it stands at the start. */
  type Shown = Pick<Api.ReplayWorld, "shapes" | "positions_m" | "orientations" | "contacts">;

  type Vector = number[];
  type Matrix = Float32Array<ArrayBuffer>;
  type Colour = [number, number, number, number];
  type Palette = Record<string, Colour>;

  interface Viewpoint {
    eye: Vector;
    target: Vector;
    distance: number;
    /** The size of what is seen, relative to the quadruped. */
    scale: number;
    /** The direction that is upwards in the picture, of length 1. */
    up: Vector;
  }

  /** Draws one frame: a matrix for each solid shape, the bodies on the ground, the camera, the colours and the path so far. */
  type Painter = (models: Matrix[], grounded: Set<number | null>, camera: Viewpoint, palette: Palette, path: Vector[]) => void;
}

/** Plotly, once its script is loaded. */
declare var Plotly:
  | { react(element: Element, data: unknown, layout: unknown, options: unknown): Promise<void>; purge(element: Element): void }
  | undefined;
