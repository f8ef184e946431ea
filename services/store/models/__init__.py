"""The tables.

    study ──< experiment ──< repetition ──< step, of its log or of a closed branch
                                    ├──< branch
                                    ├──< attempt
                                    ├──< request ──< answer
                                    └──< checkpoint, of the current step
    sensitivity, shared by experiments with the same subject, whose hash is its id
    provenance, shared by experiments through experiment_provenance; its id is a hash of its facts
    event, numbered by event_counter
    supervisor
    notification, of an event; notifier, which finds them
    deletion, of a study or an experiment;  view, a saved query
    attachment, of answers;  robot, a file that specs name by its hash
    token, of a caller;  idempotency, a request with its answer

Values that are plotted or filtered are columns; vectors are JSON arrays, in which floats round-trip exactly. Neither a
database nor JSON has nan or infinity: a fitness of nan and a squared error of infinity are NULL.

The tallies in `repetition` (steps, rollouts, seconds) are sums over its log, and change in the same transaction.
So progress is a sum over repetitions, and reads no steps.
"""

from gaplab.services.store.models.base import REVISION as REVISION
from gaplab.services.store.models.base import Base as Base
from gaplab.services.store.models.base import Number as Number
from gaplab.services.store.models.base import Reason as Reason
from gaplab.services.store.models.experiments import AttemptRow as AttemptRow
from gaplab.services.store.models.experiments import CheckpointRow as CheckpointRow
from gaplab.services.store.models.experiments import DeletionRow as DeletionRow
from gaplab.services.store.models.experiments import ExperimentRow as ExperimentRow
from gaplab.services.store.models.experiments import LeasedRow as LeasedRow
from gaplab.services.store.models.experiments import RepetitionRow as RepetitionRow
from gaplab.services.store.models.experiments import SensitivityRow as SensitivityRow
from gaplab.services.store.models.experiments import StudyRow as StudyRow
from gaplab.services.store.models.results import LOG as LOG
from gaplab.services.store.models.results import AnswerRow as AnswerRow
from gaplab.services.store.models.results import AttachmentRow as AttachmentRow
from gaplab.services.store.models.results import BranchRow as BranchRow
from gaplab.services.store.models.results import RequestRow as RequestRow
from gaplab.services.store.models.results import StepKind as StepKind
from gaplab.services.store.models.results import StepRow as StepRow
from gaplab.services.store.models.service import EventCounterRow as EventCounterRow
from gaplab.services.store.models.service import EventRow as EventRow
from gaplab.services.store.models.service import ExperimentProvenanceRow as ExperimentProvenanceRow
from gaplab.services.store.models.service import FileRow as FileRow
from gaplab.services.store.models.service import IdempotencyRow as IdempotencyRow
from gaplab.services.store.models.service import NotificationRow as NotificationRow
from gaplab.services.store.models.service import NotifierRow as NotifierRow
from gaplab.services.store.models.service import ProvenanceRow as ProvenanceRow
from gaplab.services.store.models.service import SupervisorRow as SupervisorRow
from gaplab.services.store.models.service import TokenRow as TokenRow
from gaplab.services.store.models.service import ViewRow as ViewRow
