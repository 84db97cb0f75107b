from .compare import (
    compare_log as compare_log,
)
from .compare import (
    compare_scenario as compare_scenario,
)
from .demo import (
    Demonstration as Demonstration,
)
from .demo import (
    demonstrate as demonstrate,
)
from .effort_file import write_effort as write_effort
from .excitation import excite as excite
from .identification import identify as identify
from .json_file import (
    json_text as json_text,
)
from .json_file import (
    write_json as write_json,
)
from .positioning import (
    ScenarioFile as ScenarioFile,
)
from .positioning import (
    position as position,
)
from .positioning import (
    read_scenario as read_scenario,
)
