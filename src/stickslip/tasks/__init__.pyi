from .axes import (
    axes_of_robot as axes_of_robot,
    axes_validated as axes_validated,
    identify_axes as identify_axes,
    validated as validated,
)
from .comparison import compare_log as compare_log, compare_scenario as compare_scenario
from .demo import Demonstration as Demonstration, demonstrate as demonstrate
from .excitation import excite as excite, write_effort as write_effort
from .identification import identify as identify
from .inspection import inspect as inspect, write_schema as write_schema
from .json_file import json_text as json_text, write_json as write_json
from .positioning.task import (
    ScenarioFile as ScenarioFile,
    position as position,
    read_scenario as read_scenario,
)
