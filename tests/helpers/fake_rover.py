"""ArduPilot Rover as a mission's script sees it: clock, mode, place, switch, and what each output is sent."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from lupa import LuaRuntime

AUTO, HOLD, MANUAL = 10, 4, 0
_SETTING = """
function(rover, turned)
  local function object(methods) return methods end
  local function instant(ms)
    return setmetatable({ ms = ms, tofloat = function(self) return self.ms end },
      { __sub = function(a, b) return instant_of(a.ms - b.ms) end })
  end
  instant_of = instant
  millis = function() return instant(rover.now()) end
  gcs = object({ send_text = function(_, level, text) rover.tell(text) end })
  arming = object({ is_armed = function() return rover.armed() end })
  vehicle = object({
    get_mode = function() return rover.mode() end,
    set_mode = function(_, mode) rover.set_mode(mode) end,
    nav_script_time = function() if rover.step() then return rover.step(), 71, 0, 0 end end,
    nav_script_time_done = function(_, id) rover.finish(id) end,
  })
  ahrs = object({ groundspeed_vector = function()
    return { length = function() return rover.speed() end }
  end })
  ahrs[rover.locating] = function()
    return { x = rover.place(), get_distance = function(self, other) return math.abs(self.x - other.x) end }
  end
  rc = object({ find_channel_for_option = function(_, option)
    return { get_aux_switch_pos = function() return rover.switch() end }
  end })
  param = object({ get = function(_, name) return rover.parameter(name) end })
  SRV_Channels = object({ set_output_pwm_chan_timeout = function(_, channel, pulse, ms)
    rover.send(channel, pulse, ms)
  end })
end
"""


@dataclass
class FakeRover:
    """State that a test sets, and what the script did."""

    clock: float = 0.0
    in_mode: int = AUTO
    is_armed: bool = True
    at: float = 0.0
    speed: float = 0.0
    locating: str = "get_location"
    position: int = 0
    item: int | None = 5
    told: list[str] = field(default_factory=list)
    sent: list[tuple[float, int, int]] = field(default_factory=list)
    finished: list[int] = field(default_factory=list)
    parameters: dict[str, float] = field(
        default_factory=lambda: {
            f"SERVO{n}_{key}": value
            for n, function in ((1, 73), (3, 74))
            for key, value in {"FUNCTION": function, "MIN": 1000, "TRIM": 1500, "MAX": 2000, "REVERSED": 0}.items()
        }
    )

    def load(self, text: str) -> Callable[[], Any]:
        """Run a script; what comes back is its update."""
        lua: Any = LuaRuntime(unpack_returned_tuples=True)
        asked = {
            "now": lambda: self.clock * 1000.0,
            "tell": self.told.append,
            "armed": lambda: self.is_armed,
            "mode": lambda: self.in_mode,
            "set_mode": lambda mode: setattr(self, "in_mode", mode),
            "step": lambda: self.item,
            "finish": self._finish,
            "place": lambda: self.at,
            "speed": lambda: self.speed,
            "locating": self.locating,
            "switch": lambda: self.position,
            "parameter": lambda name: self.parameters.get(name),
            "send": lambda channel, pulse, ms: self.sent.append((self.clock, channel, pulse)),
        }
        lua.eval(_SETTING)(lua.table_from(asked))
        return lua.execute(text)[0]

    def run(self, update: Callable[[], Any], seconds: float, each: Callable[[float], None] | None = None) -> None:
        """Call the script each 50 ms."""
        for _ in range(round(seconds / 0.05)):
            if each is not None:
                each(self.clock)
            update()
            self.clock = round(self.clock + 0.05, 6)

    def at_time(self, time: float) -> dict[int, int]:
        """The latest pulse of each output up to a time."""
        return {channel: pulse for when, channel, pulse in self.sent if when <= time}

    def _finish(self, id_: int) -> None:
        self.finished.append(id_)
        self.item = None
