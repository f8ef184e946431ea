/* Made by `make docs` from the OpenAPI document; what is changed here is lost. */

declare namespace Api {
  interface Alive {
    status: string;
  }
  interface AnswerRead {
    id: string;
    request: string;
    state: AnswerState;
    values: Array<number> | null;
    fitness: number | null;
    readings: Array<Array<Array<number | null>>> | null;
    failed: string | null;
    operator: string;
    note: string | null;
    attachments: Array<string>;
    traces: Array<TraceRead>;
    doubts: Array<string>;
    replaces: string | null;
    reason: string | null;
    at: string;
  }
  type AnswerState = "counted" | "conflict" | "replaced" | "void" | "dismissed";
  interface AttachmentRead {
    id: string;
    name: string;
    media_type: string;
    size: number;
  }
  interface AttemptRead {
    number: number;
    owner: string;
    started_at: string;
    ended_at: string | null;
    ending: Ending | null;
    reason: string | null;
  }
  interface BestRead {
    evaluations: number;
    known: number;
    n: number;
    mean: number;
    sd: number | null;
    experiment: string;
    name: string;
    strategy: string;
  }
  interface BranchRead {
    repetition: number;
    number: number;
    iteration: number;
    reason: string;
    steps: Array<Record<string, any>>;
    sentences: Array<string>;
    closed_at: string;
  }
  interface BudgetRead {
    name: string;
    iterations: number;
    repetitions: number;
    controller_evaluations: number;
    selection_evaluations: number;
    simulator_evaluations: number;
    controller_optimizer: string | null;
  }
  interface BudgetSpec {
    preset: "smoke" | "desk" | "paper" | "lean" | "as_published";
    controller_evaluations: number | null;
    selection_evaluations: number | null;
    simulator_evaluations: number | null;
    reuse_transfer: boolean;
  }
  interface Catalogue {
    strategies: Array<PluginRead>;
    robots: Array<PluginRead>;
    engines: Array<PluginRead>;
    tunables: Array<PluginRead>;
    optimizers: Array<PluginRead>;
    discrepancies: Array<PluginRead>;
    controllers: Array<PluginRead>;
    tasks: Array<PluginRead>;
    tuners: Array<PluginRead>;
    budgets: Array<BudgetRead>;
    ignored: Array<IgnoredFile>;
    defaults: Record<string, any>;
  }
  interface CellError {
    line: number;
    column: string | null;
    value: string | null;
    message: string;
    permitted: string | null;
  }
  interface Chart {
    data: Array<Record<string, any>>;
    layout: Record<string, any>;
  }
  interface Checked {
    robot: PluginRef;
    engine: PluginRef;
    controller: PluginRef | null;
    task: PluginRef | null;
    tunables: Array<ResolvedTunable>;
    points: number;
    evaluations: number;
  }
  interface Comparison {
    first: string;
    first_name: string;
    second: string;
    second_name: string;
    from_evaluations: number;
    to_evaluations: number;
    n_first: number;
    n_second: number;
    sizes: string;
    difference: number | null;
    effect_size: number | null;
    difference_text: string;
    effect_size_text: string;
    student: Test;
    welch: Test;
    mann_whitney: Test;
    fitness: Fitness;
    unit: string;
    where: string;
    cost: number | null;
    evaluations_first: number | null;
    evaluations_second: number | null;
    shared_evaluations: number;
    caution: string | null;
    lower: number | null;
    upper: number | null;
    warnings: Array<string>;
    improvement: Estimate;
    shared_streams: boolean;
    streams: string;
    trusted: Trusted;
    n_paired: number;
    paired_t: Test;
    wilcoxon: Test;
    brown_forsythe: Test;
    summary_first: Summary;
    summary_second: Summary;
    equivalence: Equivalence | null;
    pooled: Pooled | null;
  }
  interface ConflictSpec {
    counts: "this" | "other";
    reason: string;
    operator: string | null;
  }
  interface Consequences {
    answer: string | null;
    request: string;
    repetition: number;
    iteration: number;
    steps: number;
    branch: number | null;
    measurements: number;
    words: string;
  }
  type ControllerKind = "sample" | "transfer";
  interface CorrectionSpec {
    values: Array<number> | null;
    readings: Array<Array<Array<number | null>>> | null;
    unit: string | null;
    failed: string | null;
    reason: string;
    operator: string | null;
  }
  interface Curve {
    experiment: string;
    name: string;
    strategy: string;
    study_name: string;
    state: State;
    unit: string;
    fitness: Fitness;
    direct: boolean;
    level: boolean;
    known: number;
    points: Array<CurvePoint>;
    best_of: Array<number | null>;
  }
  interface CurvePoint {
    evaluations: number;
    n: number;
    mean: number | null;
    sd: number | null;
    lower: number | null;
    upper: number | null;
    values: Array<number | null>;
  }
  interface DeletionRead {
    id: string;
    name: string;
    study: string | null;
    deleted_at: string;
  }
  interface DiffColumn {
    id: string;
    name: string;
    experiments: number;
  }
  interface Distribution {
    n: number;
    mean: number | null;
    sd: number | null;
    least: number | null;
    greatest: number | null;
    text: string;
  }
  interface DoubtsRead {
    doubts: Array<string>;
  }
  interface Edit {
    name: string | null;
    notes: string | null;
    tags: Array<string> | null;
    add_tags: Array<string>;
    remove_tags: Array<string>;
  }
  type Ending = "completed" | "paused" | "stopped" | "cancelled" | "handed back" | "waiting" | "lost" | "failed";
  interface EngineCost {
    engine: string;
    seconds_per_rollout: number;
    measured: boolean;
  }
  interface Equivalence {
    margin: number;
    test: "welch" | "paired_t";
    p: number | null;
    p_holm: number | null;
    verdict: EquivalenceVerdict;
    words: string;
  }
  type EquivalenceVerdict = "equivalent" | "different" | "undecided";
  interface Estimate {
    value: number | null;
    lower: number | null;
    upper: number | null;
    text: string;
  }
  interface EstimateRead {
    experiments: Array<ExperimentCost>;
    engines: Array<EngineCost>;
    rollouts: number;
    core_seconds: number;
    cores: number;
    seconds: number;
    supervisors: number;
    specs: Array<Record<string, any>>;
  }
  type EventKind = "submitted" | "imported" | "started" | "waiting" | "pausing" | "paused" | "resumed" | "stopping" | "extended" | "retried" | "completed" | "failed" | "cancelled" | "edited" | "archived" | "unarchived" | "deleted" | "notified" | "notification_failed" | "sensitivity_ended" | "versions_refused" | "versions_accepted" | "repetition_claimed" | "repetition_completed" | "repetition_failed" | "repetition_lost" | "repetition_handed_back" | "repetition_waits" | "repetition_paused" | "repetition_stopped" | "repetition_cancelled" | "requested" | "refused" | "taken" | "released" | "take_expired" | "conflicting" | "corrected" | "voided" | "decided" | "selected" | "measured" | "tuned" | "transferred" | "probed";
  interface EventPage {
    items: Array<EventRead>;
    last: number;
    latest: number;
  }
  interface EventRead {
    number: number;
    kind: EventKind;
    experiment: string;
    study: string | null;
    repetition: number | null;
    body: Record<string, any>;
    at: string;
    sentence: string;
  }
  interface ExperimentCost {
    name: string;
    strategy: string;
    engine: string;
    repetitions: number;
    iterations: number;
    rollouts: number;
    runs: number;
    core_seconds: number;
  }
  interface ExperimentRead {
    id: string;
    name: string;
    study: string;
    strategy: string;
    direct: boolean;
    level: boolean;
    state: State;
    spec: Record<string, any>;
    sensors: SensorsRead | null;
    priority: number;
    max_parallel: number | null;
    progress: Progress;
    caveat: string | null;
    fitness: FitnessRead | null;
    best_fitness: number | null;
    reasons: Array<string>;
    sensitivity: string | null;
    doubts: Array<string>;
    warnings: Array<string>;
    created_at: string;
    started_at: string | null;
    ended_at: string | null;
  }
  interface ExperimentSpec {
    priority: number;
    max_parallel: number | null;
    iterations: number | null;
    repetitions: number | null;
    stop: Stop | null;
    robot: PluginRef;
    controller: PluginRef | null;
    task: PluginRef | null;
    engine: PluginRef | null;
    optimizer: PluginRef;
    controller_optimizer: PluginRef | null;
    tunables: Array<TunableRef>;
    discrepancy: PluginRef;
    tuner: PluginRef;
    held_out: number;
    reality: RealitySpec;
    budget: BudgetSpec;
    seed: number;
    name: string | null;
    strategy: PluginRef;
  }
  interface ExtensionSpec {
    iterations: number | null;
    repetitions: number | null;
  }
  interface FigureRead {
    figure: Chart;
    title: string;
    caption: string;
    alt: string;
    empty: boolean;
    table: TableRead | null;
  }
  type Fitness = "recorded" | "transferred" | "equal_chances";
  interface FitnessRead {
    evaluations: number;
    known: number;
    n: number;
    mean: number;
    sd: number | null;
  }
  type Found = "higher" | "lower" | "wider" | "narrower" | "n. s." | "too few values that vary" | "not paired";
  interface Framing {
    scale: number;
    height_m: number;
  }
  interface Health {
    status: "ok" | "degraded";
    warnings: Array<string>;
  }
  interface HolderSpec {
    take: number;
  }
  type Identification = "identified" | "partly identified" | "not identified" | "doubtful" | "unknown";
  interface IgnoredFile {
    file: string;
    why: string;
  }
  interface ImportRead {
    study: string;
    experiments: Array<string>;
    renamed: Record<string, string>;
    called_off: Array<string>;
  }
  interface KnownSample {
    values: Array<number>;
    readings: Array<Array<Array<number | null>>> | null;
    genome: Array<number>;
    unit: string | null;
  }
  interface LimitsSpec {
    joint_speed: number | null;
    torque: number | null;
    tilt: number | null;
    height: number | null;
  }
  type MeasurementKind = "sample" | "probe";
  interface MeasurementSpec {
    take: number | null;
    values: Array<number> | null;
    readings: Array<Array<Array<number | null>>> | null;
    traces: Array<string> | null;
    lags_s: Array<number | null> | null;
    unit: string | null;
    failed: string | null;
    operator: string | null;
    note: string | null;
    attachments: Array<string>;
    confirmed: boolean;
  }
  interface MisfitPoint {
    iteration: number;
    error: Distribution;
    expected_error: Distribution;
    held_out_error: Distribution;
    gap: Distribution;
    tunables: Array<TunableDistribution>;
  }
  interface MisfitRead {
    experiment: string;
    unit: string;
    error_unit: string;
    points: Array<MisfitPoint>;
    remarks: Array<string>;
    unreproduced: string;
    held_out: number;
    noise: number | null;
    verdicts: Array<TunableVerdict>;
    note: string;
  }
  interface NotesRead {
    html: string;
  }
  interface Page_RequestRead_ {
    items: Array<RequestRead>;
    next: string | null;
  }
  interface Page_SampleRead_ {
    items: Array<SampleRead>;
    next: string | null;
  }
  interface Page_SimulatorRead_ {
    items: Array<SimulatorRead>;
    next: string | null;
  }
  interface Page_StudyRead_ {
    items: Array<StudyRead>;
    next: string | null;
  }
  interface PluginRead {
    name: string;
    summary: string;
    source: string;
    options: Record<string, any>;
    presets: Record<string, Record<string, any>>;
    available: boolean;
    note: string | null;
    details: Record<string, any>;
  }
  type PluginRef = string | Record<string, any>;
  interface PoolRead {
    sha256: string;
    name: string;
    lost: Array<string>;
    created_at: string;
    origin: string;
    recordings: number;
    sensors: Array<string>;
    actuators: Array<string>;
    seconds: number;
  }
  type PoolRef = string | Record<string, any>;
  interface Pooled {
    n_first: number;
    n_second: number;
    sizes: string;
    difference: number | null;
    effect_size: number | null;
    difference_text: string;
    effect_size_text: string;
    student: Test;
    welch: Test;
    mann_whitney: Test;
    caution: string;
  }
  interface Prediction {
    repetition: number;
    iteration: number;
    simulated_before: number | null;
    simulated_after: number | null;
    fitness: number | null;
  }
  interface Predictions {
    experiment: string;
    unit: string;
    items: Array<Prediction>;
    pending: number;
    left_out: number;
  }
  interface Problem {
    type: string;
    title: string;
    status: number;
    detail: string;
    errors: Array<SpecError>;
  }
  interface Progress {
    repetitions: number;
    completed: number;
    failed: number;
    iterations: number;
    iterations_done: number;
    counted_iterations: number;
    counted_iterations_done: number;
    rollouts: number;
    rollouts_done: number;
    rollouts_failed: number;
    rollouts_saved: number;
    time_left: TimeLeft | null;
    steps: Array<StepRead>;
    share: number;
    text: string;
  }
  interface Provenance {
    gaplab: string;
    code: string;
    commit: string | null;
    dirty: boolean | null;
    python: string;
    libraries: Record<string, string>;
    engines: Record<string, string>;
    architecture: string;
    processor: string;
    system: string;
    spec_version: number;
    plugins: Record<string, string>;
    outside: Record<string, string>;
  }
  interface ProvenanceRead {
    computed_with: string | null;
    refused_by: string | null;
    uses: Array<ProvenanceUse>;
  }
  interface ProvenanceUse {
    id: string;
    since: string;
    repetitions: number;
    provenance: Provenance;
  }
  interface RealitySpec {
    kind: "simulated" | "physical" | "recorded";
    pool: PoolRef | null;
    held_out: number | string | null;
    engine: PluginRef | null;
    parameters: Record<string, number>;
    noise: number | null;
    noise_unit: number | null;
    bench: string | null;
    repeats: number;
    samples: Array<KnownSample>;
    probes: "each" | "last" | "never" | null;
    limits: LimitsSpec | null;
    beyond: "warn" | "refuse";
  }
  interface ReleaseSpec {
    take: number;
    operator: string | null;
    reason: string | null;
    moved_s: number | null;
  }
  interface RepetitionRead {
    number: number;
    state: State;
    iterations_done: number;
    rollouts_done: number;
    attempts: number;
    error: string | null;
    measuring_at: string | null;
    started_at: string | null;
    ended_at: string | null;
  }
  interface Replay {
    experiment: string;
    repetition: number;
    iteration: number;
    kind: ControllerKind;
    simulator: number | null;
    robot: string;
    unit: string;
    bodies: Array<string>;
    feet: Array<string>;
    observed: number;
    framing: Framing;
    times_s: Array<number>;
    counted_s: [number, number];
    simulation: ReplayWorld | null;
    reality: ReplayWorld | null;
    readings: ReplayReadings | null;
  }
  interface ReplayReadings {
    sensors: Array<string>;
    units: Array<string>;
    noises: Array<number>;
    times_s: Array<number>;
    simulation: Array<Array<number | null>> | null;
    reality: Array<Array<number | null>> | null;
  }
  interface ReplayWorld {
    shapes: Array<Shape>;
    positions_m: Array<Array<number>>;
    orientations: Array<Array<number>>;
    slope_rad: number;
    contacts: Array<Array<[number, number]>>;
    engine: string;
    fitness: number | null;
    recorded: number | null;
    heights_m: Array<number>;
    speeds_m_s: Array<number>;
  }
  interface RequestRead {
    id: string;
    experiment: string;
    experiment_name: string;
    experiment_state: State;
    repetition: number;
    iteration: number;
    kind: MeasurementKind;
    robot: string;
    unit: string;
    bench: string;
    repeats: number;
    genome: Array<number>;
    state: RequestState;
    takes: number;
    unanswered: number;
    taken_by: string | null;
    taken_until: string | null;
    busy: boolean;
    safety: Safety | null;
    expected: Array<string>;
    between_repeats: string | null;
    needs: string | null;
    same_as: string | null;
    branch: number | null;
    answers: Array<AnswerRead>;
    created_at: string;
    ended_at: string | null;
  }
  type RequestState = "open" | "taken" | "measured" | "failed" | "withdrawn" | "stuck";
  type ResolvedTunable = string | Record<string, any>;
  interface RobotRead {
    sha256: string;
    name: string;
    lost: Array<string>;
    created_at: string;
    file: string | null;
    bodies: number;
    actuators: number;
    mass_kg: number;
  }
  interface RobotShapes {
    shapes: Array<Shape>;
    positions_m: Array<Array<number>>;
    orientations: Array<Array<number>>;
    slope_rad: number;
    contacts: Array<Array<[number, number]>>;
    scale: number;
    middle_m: [number, number, number];
  }
  interface Safety {
    simulators: number;
    failed: number;
    joint_speed: number | null;
    torque: number | null;
    tilt: number | null;
    height: number | null;
    clearance: number | null;
    falls: number;
    fitness_low: number | null;
    fitness_high: number | null;
    beyond: Array<string>;
    unknown: Array<string>;
  }
  interface SampleRead {
    repetition: number;
    iteration: number;
    kind: MeasurementKind;
    genome: Array<number>;
    fitness: number | null;
    readings: Array<number | null> | null;
    repeats: Array<number> | null;
    standard_error: number | null;
    measured_by: string;
    measured_at: string;
  }
  interface SamplesRead {
    samples: Array<KnownSample>;
    errors: Array<CellError>;
    more: number;
  }
  interface ScheduleChange {
    priority: number;
    max_parallel: number | null;
  }
  interface Sensitivity {
    name: string;
    effect: number | null;
    relative_effect: number | null;
    roughness: number | null;
    failures: number;
    verdict: Verdict;
    values: Array<number>;
    fitness: Array<Array<number | null>>;
  }
  interface SensitivityRead {
    id: string;
    state: State;
    spec: Checked;
    rollouts: number;
    unit: string;
    tunables: Array<Sensitivity>;
    warnings: Array<string>;
    reason: string | null;
    created_at: string;
    started_at: string | null;
    ended_at: string | null;
  }
  interface SensitivitySpec {
    iterations: number | null;
    repetitions: number | null;
    stop: Stop | null;
    robot: PluginRef;
    controller: PluginRef | null;
    task: PluginRef | null;
    engine: PluginRef | null;
    optimizer: PluginRef;
    controller_optimizer: PluginRef | null;
    tunables: Array<TunableRef>;
    discrepancy: PluginRef;
    tuner: PluginRef;
    held_out: number;
    reality: RealitySpec;
    budget: BudgetSpec;
    seed: number;
    points: number;
    evaluations: number;
  }
  interface SensorsRead {
    names: Array<string>;
    units: Array<string>;
    noises: Array<number>;
    times_s: Array<number>;
    needed: boolean;
  }
  interface SettingRead {
    pointer: string;
    setting: string;
    values: Array<Array<any>>;
    texts: Array<string>;
  }
  interface Shape {
    kind: "box" | "sphere" | "capsule" | "cylinder" | "hull" | "plane";
    size_m: Array<number>;
    position_m: [number, number, number];
    orientation: [number, number, number, number];
    role: "trunk" | "limb" | "foot" | "ground";
    body: number | null;
    vertices_m: Array<[number, number, number]>;
    faces: Array<Array<number>>;
  }
  interface SimulatorRead {
    repetition: number;
    iteration: number;
    rank: number;
    parameters: Record<string, number>;
    squared_error: number | null;
    error: number | null;
    intervals: Record<string, [number, number]> | null;
    expected_error: number | null;
    surprise: number | null;
    weight: number | null;
    held_out_error: number | null;
  }
  interface SpecDiff {
    columns: Array<DiffColumn>;
    settings: Array<SettingRead>;
    equal: number;
    note: string;
    warnings: Array<string>;
    hidden: Array<string>;
  }
  interface SpecError {
    pointer: string;
    value: any;
    message: string;
    permitted: Array<string> | string | null;
    nearest: string | null;
  }
  interface SpecRead {
    spec: Record<string, any> | null;
    resolved: Array<Record<string, any>>;
    remarks: Array<string>;
  }
  type State = "QUEUED" | "RUNNING" | "PAUSING" | "PAUSED" | "STOPPING" | "COMPLETED" | "FAILED" | "CANCELLED" | "WAITING";
  interface StepRead {
    repetition: number;
    iteration: number;
    kind: string;
    rollouts: number;
    budget: number;
  }
  interface Stop {
    x: "rollouts" | "time" | "cost";
    cost_s: number;
    rollout_s: number | null;
    cores: number;
    machine: number;
    attention: number;
    wear: number;
    at: number;
  }
  interface StudyRead {
    id: string;
    name: string;
    notes: string | null;
    tags: Array<string>;
    edits: number;
    archived_at: string | null;
    state: State;
    caveat: string | null;
    best: BestRead | null;
    experiments: Array<ExperimentRead>;
    progress: Progress;
    created_at: string;
  }
  interface StudySpec {
    priority: number;
    max_parallel: number | null;
    iterations: number | null;
    repetitions: number | null;
    stop: Stop | null;
    robot: PluginRef;
    controller: PluginRef | null;
    task: PluginRef | null;
    engine: PluginRef | null;
    optimizer: PluginRef;
    controller_optimizer: PluginRef | null;
    tunables: Array<TunableRef>;
    discrepancy: PluginRef;
    tuner: PluginRef;
    held_out: number;
    reality: RealitySpec;
    budget: BudgetSpec;
    seed: number;
    name: string | null;
    strategies: Array<PluginRef>;
    direct_repetitions: number | null;
  }
  interface Summary {
    n: number;
    sd: number | null;
    mean: Estimate;
    interquartile_mean: Estimate;
  }
  interface TableRead {
    head: Array<string>;
    rows: Array<Array<string>>;
  }
  interface TakeSpec {
    operator: string;
    lease_s: number;
  }
  interface Test {
    p: number | null;
    p_holm: number | null;
    found: Found;
    text: string;
    statistic: number | null;
    degrees_of_freedom: number | null;
  }
  interface TimeLeft {
    low_s: number;
    high_s: number;
    text: string;
  }
  interface TraceRead {
    attachment: string;
    lag_s: number;
    match: number | null;
    after_rest: boolean;
  }
  interface TracesRead {
    values: Array<number>;
    unit: string;
    readings: Array<Array<Array<number | null>>> | null;
    traces: Array<TraceRead>;
    doubts: Array<string>;
  }
  interface TracesSpec {
    traces: Array<string>;
    lags_s: Array<number | null> | null;
  }
  type Trend = "rising" | "flat" | "falling" | "unclear" | "too_few";
  interface TrendRead {
    experiment: string;
    name: string;
    trend: Trend;
    n: number;
    since: number | null;
    last: number;
    gain: number | null;
    lower: number | null;
    upper: number | null;
    continuing: boolean | null;
    sentence: string;
  }
  interface Trusted {
    p: number | null;
    p_holm: number | null;
    found: Found;
    text: string;
    test: "welch" | "paired_t";
  }
  interface TunableDistribution {
    n: number;
    mean: number | null;
    sd: number | null;
    least: number | null;
    greatest: number | null;
    text: string;
    name: string;
    lower: number;
    upper: number;
    at_lower: number | null;
    at_upper: number | null;
    at_bounds: string;
    spread: number | null;
    interval: number | null;
    posterior: number | null;
  }
  type TunableRef = string | Record<string, any>;
  interface TunableVerdict {
    name: string;
    verdict: Identification;
    remaining: number | null;
    sentence: string;
    helps: Array<string>;
  }
  type Verdict = "nothing" | "rough" | "smooth" | "unknown";
  interface VerdictRead {
    headline: string;
    sentences: Array<string>;
    trends: Array<TrendRead>;
    evaluations: number | null;
    rules: Array<string>;
  }
  interface ViewRead {
    query: string | null;
    sort: "created_at" | "-created_at" | "name" | "-name" | "state" | "-state" | "fitness" | "-fitness";
    name: string;
    created_at: string;
  }
  interface ViewSpec {
    query: string | null;
    sort: "created_at" | "-created_at" | "name" | "-name" | "state" | "-state" | "fitness" | "-fitness";
  }
  interface VoidSpec {
    reason: string;
    operator: string | null;
  }
  interface WebhookRead {
    host: string | null;
  }
  interface WebhookSpec {
    url: string;
  }
}
