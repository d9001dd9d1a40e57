local COMMAND = $command -- first parameter of the mission's step NAV_SCRIPT_TIME
local FENCE = $fence -- metres from where the manoeuvre begins
local SPEED = $speed -- metres a second over ground
local AGAIN = 5 -- metres from where it first began, within which it may begin again: as near as waypoints are reached
local SECONDS = $seconds
local AUTO, HOLD = 10, 4 -- modes of Rover
local ABORT_OPTION, HIGH = 300, 2 -- RCn_OPTION of a switch that breaks off (Scripting1), and its upper position
local OVERRIDE, PERIOD = 200, 50 -- milliseconds

-- SERVOn_FUNCTION of each thruster, and what its commands are
local THRUSTERS = {
$thrusters
}
-- from when [s], and the command of each thruster
local HELD = {
$rows
}

local running, begun, origin, outputs = nil, nil, nil, nil

local function tell(text)
  gcs:send_text(5, "undertow: " .. text)
end

-- the outputs of a thruster, each with its number and its ends
local function outputs_of(thruster)
  local found = {}
  for n = 1, 16 do
    local name = "SERVO" .. n
    if param:get(name .. "_FUNCTION") == thruster.func then
      local low, trim = param:get(name .. "_MIN"), param:get(name .. "_TRIM")
      local high, turned = param:get(name .. "_MAX"), param:get(name .. "_REVERSED") == 1
      table.insert(found, { channel = n - 1, low = low, trim = trim, high = high, turned = turned })
    end
  end
  return found
end

local function pulse(thruster, output, command)
  local wanted = command
  if not thruster.pulse then
    local share = output.turned and -command or command
    wanted = output.trim + share * (share > 0 and output.high - output.trim or output.trim - output.low)
  end
  return math.floor(math.max(output.low, math.min(output.high, wanted)) + 0.5)
end

local function send(commands)
  for k, thruster in ipairs(THRUSTERS) do
    for _, output in ipairs(outputs[k]) do
      SRV_Channels:set_output_pwm_chan_timeout(output.channel, pulse(thruster, output, commands[k]), OVERRIDE)
    end
  end
end

-- where the boat is; get_position in versions that do not have get_location yet
local function place()
  if ahrs.get_location then
    return ahrs:get_location()
  end
  return ahrs:get_position()
end

-- Why the manoeuvre must not go on; nil where nothing speaks against it.
local function objection()
  if not arming:is_armed() then
    return "disarmed"
  end
  local switch = rc:find_channel_for_option(ABORT_OPTION)
  if switch and switch:get_aux_switch_pos() == HIGH then
    return "the switch breaks it off"
  end
  local here = place()
  if not here then
    return "no position"
  end
  if origin and here:get_distance(origin) > FENCE then
    return string.format("%.0f m from the start", FENCE)
  end
  if not running and origin and here:get_distance(origin) > AGAIN then
    return string.format("%.0f m from the first start", here:get_distance(origin))
  end
  if ahrs:groundspeed_vector():length() > SPEED then
    return string.format("faster than %.1f m/s", SPEED)
  end
  return nil
end

local function stop(why)
  if outputs then
    send(HELD[1].commands)
  end
  running = nil
  vehicle:set_mode(HOLD)
  tell("broken off, " .. why)
end

local function start(id)
  outputs = {}
  for k, thruster in ipairs(THRUSTERS) do
    outputs[k] = outputs_of(thruster)
    if #outputs[k] == 0 then
      outputs = nil
      return stop("no output has SERVOn_FUNCTION " .. thruster.func)
    end
  end
  local why = objection()
  if why then
    outputs = nil
    return stop(why)
  end
  running, begun, origin = id, millis(), origin or place()
  tell(string.format("driving for %.0f s", SECONDS))
end

function update()
  if not running then
    local id, command = vehicle:nav_script_time()
    if id and command == COMMAND and vehicle:get_mode() == AUTO then
      start(id)
    end
    return update, PERIOD
  end
  local id = vehicle:nav_script_time()
  if vehicle:get_mode() ~= AUTO or id ~= running then
    running = nil
    tell("broken off, somebody else drives")
    return update, PERIOD
  end
  local why = objection()
  if why then
    stop(why)
    return update, PERIOD
  end
  local time = (millis() - begun):tofloat() / 1000
  if time >= SECONDS then
    send(HELD[1].commands)
    vehicle:nav_script_time_done(running)
    running = nil
    tell("done")
    return update, PERIOD
  end
  local now = HELD[1]
  for _, row in ipairs(HELD) do
    if row.from <= time + 0.001 then
      now = row
    end
  end
  send(now.commands)
  return update, PERIOD
end

return update, 1000
