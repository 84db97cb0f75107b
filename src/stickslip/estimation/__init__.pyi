from .base import (
    DetailedEstimator as DetailedEstimator,
    EstimationTask as EstimationTask,
    Estimator as Estimator,
    OnlineEstimator as OnlineEstimator,
    OnlineIntervalEstimator as OnlineIntervalEstimator,
)
from .energy.estimator import EnergyEstimator as EnergyEstimator
from .energy.published.estimator import PublishedEnergyEstimator as PublishedEnergyEstimator
from .energy.published.sensor_noise import (
    SensorNoise as SensorNoise,
    sensor_noise_of as sensor_noise_of,
)
from .examine import examine as examine
from .fit.fitted import Fit as Fit
from .joint.estimator import JointEstimator as JointEstimator
from .likelihood.bound import CramerRaoBound as CramerRaoBound, cramer_rao_bound as cramer_rao_bound
from .likelihood.estimator import (
    LikelihoodMaximum as LikelihoodMaximum,
    MaximumLikelihoodEstimator as MaximumLikelihoodEstimator,
)
from .likelihood.input_design import (
    DesignedInput as DesignedInput,
    InputLimits as InputLimits,
    design_input as design_input,
)
from .likelihood.process_noise.estimator import (
    ProcessNoiseLikelihoodEstimator as ProcessNoiseLikelihoodEstimator,
)
from .likelihood.process_noise.uncertainty import (
    NoiseLevels as NoiseLevels,
    process_noise_bound as process_noise_bound,
)
from .online.kalman.extended_kalman import ExtendedKalmanFilter as ExtendedKalmanFilter
from .online.observers.adaptive_observers import (
    FriedlandParkObserver as FriedlandParkObserver,
    GradientEstimator as GradientEstimator,
    LiaoChienObserver as LiaoChienObserver,
    YazdizadehKhorasaniObserver as YazdizadehKhorasaniObserver,
)
from .online.observers.least_squares_observer import LeastSquaresObserver as LeastSquaresObserver
from .online.recursive_least_squares import RecursiveLeastSquares as RecursiveLeastSquares
from .registry import ESTIMATORS as ESTIMATORS, EstimatorEntry as EstimatorEntry
from .regression.free_decay import (
    DecayingExtremes as DecayingExtremes,
    FreeDecayEstimator as FreeDecayEstimator,
)
from .regression.idim import (
    IdimInstrumentalVariables as IdimInstrumentalVariables,
    IdimLeastSquares as IdimLeastSquares,
)
from .regression.resimulation import replay as replay, unexplained_effort as unexplained_effort
from .regression.stribeck import StribeckEstimator as StribeckEstimator
from .selection.estimator import SelectedModelEstimator as SelectedModelEstimator
from .selection.evaluation.prediction import predict_effort as predict_effort
from .selection.tuning import SelectionTuning as SelectionTuning
