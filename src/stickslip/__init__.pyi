from .control import (
    PD as PD,
)
from .control import (
    AxisLandingController as AxisLandingController,
)
from .control import (
    Dither as Dither,
)
from .control import (
    ExactPulseController as ExactPulseController,
)
from .control import (
    FeedbackController as FeedbackController,
)
from .control import (
    FrictionCompensation as FrictionCompensation,
)
from .control import (
    LandingController as LandingController,
)
from .control import (
    Move as Move,
)
from .control import (
    Notch as Notch,
)
from .control import (
    OnlineFriction as OnlineFriction,
)
from .control import (
    PIDController as PIDController,
)
from .control import (
    PointToPoint as PointToPoint,
)
from .control import (
    PreciseController as PreciseController,
)
from .control import (
    ProfileController as ProfileController,
)
from .control import (
    PulseAmplitudeWidthController as PulseAmplitudeWidthController,
)
from .control import (
    PulseWidthController as PulseWidthController,
)
from .control import (
    ResetIntegral as ResetIntegral,
)
from .control import (
    RestDetection as RestDetection,
)
from .control import (
    TrackedLandingController as TrackedLandingController,
)
from .estimation import (
    ESTIMATORS as ESTIMATORS,
)
from .estimation import (
    EnergyEstimator as EnergyEstimator,
)
from .estimation import (
    EstimationTask as EstimationTask,
)
from .estimation import (
    ExtendedKalmanFilter as ExtendedKalmanFilter,
)
from .estimation import (
    FreeDecayEstimator as FreeDecayEstimator,
)
from .estimation import (
    FriedlandParkObserver as FriedlandParkObserver,
)
from .estimation import (
    GradientEstimator as GradientEstimator,
)
from .estimation import (
    IdimInstrumentalVariables as IdimInstrumentalVariables,
)
from .estimation import (
    IdimLeastSquares as IdimLeastSquares,
)
from .estimation import (
    JointEstimator as JointEstimator,
)
from .estimation import (
    LeastSquaresObserver as LeastSquaresObserver,
)
from .estimation import (
    LiaoChienObserver as LiaoChienObserver,
)
from .estimation import (
    MaximumLikelihoodEstimator as MaximumLikelihoodEstimator,
)
from .estimation import (
    ProcessNoiseLikelihoodEstimator as ProcessNoiseLikelihoodEstimator,
)
from .estimation import (
    PublishedEnergyEstimator as PublishedEnergyEstimator,
)
from .estimation import (
    RecursiveLeastSquares as RecursiveLeastSquares,
)
from .estimation import (
    SelectedModelEstimator as SelectedModelEstimator,
)
from .estimation import (
    StribeckEstimator as StribeckEstimator,
)
from .estimation import (
    YazdizadehKhorasaniObserver as YazdizadehKhorasaniObserver,
)
from .estimation import (
    cramer_rao_bound as cramer_rao_bound,
)
from .estimation import (
    design_input as design_input,
)
from .estimation import (
    examine as examine,
)
from .estimation import (
    predict_effort as predict_effort,
)
from .estimation import (
    process_noise_bound as process_noise_bound,
)
from .friction import (
    CoulombViscousFriction as CoulombViscousFriction,
)
from .friction import (
    DahlFriction as DahlFriction,
)
from .friction import (
    ElastoPlasticFriction as ElastoPlasticFriction,
)
from .friction import (
    LuGreFriction as LuGreFriction,
)
from .friction import (
    StribeckFriction as StribeckFriction,
)
from .tasks import (
    compare_log as compare_log,
)
from .tasks import (
    compare_scenario as compare_scenario,
)
from .tasks import (
    excite as excite,
)
from .tasks import (
    identify as identify,
)
from .tasks import (
    identify_axes as identify_axes,
)
from .tasks import (
    inspect as inspect,
)
from .tasks import (
    json_text as json_text,
)
from .tasks import (
    position as position,
)
from .tasks import (
    read_scenario as read_scenario,
)
from .tasks import (
    write_json as write_json,
)
from .logs import (
    AxisSchema as AxisSchema,
)
from .logs import (
    LogSchema as LogSchema,
)
from .logs import (
    find_benchmark as find_benchmark,
)
from .logs import (
    log_from_frame as log_from_frame,
)
from .logs import (
    read_axes as read_axes,
)
from .logs import (
    read_log as read_log,
)
from .logs import (
    read_schema as read_schema,
)
from .logs import (
    write_csv as write_csv,
)
from .plants import (
    FlexibleArm as FlexibleArm,
)
from .plants import (
    SingleMass as SingleMass,
)
from .records import (
    AxisLog as AxisLog,
)
from .records import (
    FrictionEstimate as FrictionEstimate,
)
from .records import (
    Identification as Identification,
)
from .records import (
    InputError as InputError,
)
from .records import (
    LearnedPulses as LearnedPulses,
)
from .records import (
    SensorSample as SensorSample,
)
from .records import (
    Status as Status,
)
from .presentation import (
    figures_of as figures_of,
)
from .presentation import (
    write_report as write_report,
)
from .simulation import (
    Sensors as Sensors,
)
from .simulation import (
    simulate as simulate,
)
from .simulation import (
    simulate_batch as simulate_batch,
)
from .simulation import (
    simulate_closed_loop as simulate_closed_loop,
)

__version__: str
