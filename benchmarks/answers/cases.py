"""The cases of answers.py: command lines without `omnidyn`, and expressions over the public names of the package.

A name of a folder or file is of inputs.py. && stands between commands that follow one another.
"""

DEMO = """
demo
demo --out u.csv
demo --out floor --json
demo --out none/demo
--version
--help
fly
identify --help
"""

ROBOTS = """
robots
robots --json
deadzone axebot
deadzone axebot-lab --json
deadzone robotino --json
deadzone four-wheel
deadzone mecanum --json
deadzone sticky.toml --json
deadzone ellipse.toml --json
deadzone wheels.toml --json
deadzone mixed.toml --json
deadzone weak.toml
deadzone free.toml
deadzone axebot --pattern -1,2,-3 --json
deadzone mixed.toml --pattern 1,1,1 --json
deadzone axebot --pattern 0,0,0
deadzone axebot --pattern 1,2
deadzone axebot --pattern a,b,c
deadzone axebot --map map.png
deadzone ellipse.toml --map map.svg --json
deadzone axebot --map map.pdf
deadzone axbot
deadzone bad_key.toml
deadzone bad_range.toml
deadzone bad_text.toml
deadzone bad_toml.toml
deadzone bad_law.toml
deadzone bad_level.toml
deadzone bad_loop.toml
deadzone bad_coil.toml
"""

INIT = """
init mini --azimuth 60,180,300 --wheel-radius 0.04 --robot-radius 0.125 --mass 8
init mini --azimuth 60,180,300 --wheel-radius 0.04 --robot-radius 0.125 --mass 8 --voltage-limit 24 --json
init box2 --azimuth 45,135,-135,-45 --wheel-radius 0.04 --robot-radius 0.125 --mass 8 --friction axes -o -
init crab --mecanum --wheel-radius 0.05 --robot-radius 0.3 --mass 12
init mine --like robotino --mass 16
init mine --like axebot --azimuth 45,135,-135,-45 --json
init mine --like axebot --wheels 4
init crab --like axebot --mecanum
init bot --log init1.csv --wheel-radius 0.04 --mass 8
init bot --log init16.csv --wheel-radius 0.04 --mass 8 --json
init bot --log noturn.csv --wheel-radius 0.04 --mass 8
init bot --log full.csv --wheel-radius 0.035 --mass 1.5 --voltage-limit 6
init bot --log dialect/places.csv --wheel-radius 0.04 --mass 8 --column t=count:ms --column w1=front
init bot --log dialect/places.csv --wheel-radius 0.04 --mass 8 --map places.toml --json
check dialect/places.csv --map places.toml
init mini --azimuth 60,180 --wheel-radius 0.04 --robot-radius 0.125 --mass 8
init mini --azimuth 60,180,300 --wheel-radius 0.04
init mini --azimuth 0,180,0 --wheel-radius 0.04 --robot-radius 0.125 --mass 8
init mini --azimuth 60,180,300 --wheel-radius 0.04 --robot-radius 0.125 --mass -8
init box --azimuth 60,180,300 --wheel-radius 0.04 --robot-radius 0.125 --mass 8
init m --azimuth 60,180,300 --wheel-radius 0.04 --robot-radius 0.125 --mass 8 && simulate m.toml high.csv --json
"""

CHECK = """
check full.csv --robot box.toml
check full.csv --robot box.toml --json
check full.csv
check full.csv --robot robotino --json
check full.csv --robot four-wheel
check bad/swapped.csv --robot box.toml
check bad/inverted.csv --robot box.toml --json
check bad/inverted_u.csv --robot box.toml
check bad/rpm.csv --robot box.toml
check bad/gear.csv --robot box.toml --json
check bad/late.csv --robot box.toml --json
check bad/stuck.csv --robot box.toml
check bad/dead.csv --robot box.toml
check bad/spikes.csv --robot box.toml
check bad/placeholder.csv
check bad/wrapped.csv --robot box.toml
check bad/slip.csv --robot box.toml --json
check bad/gap.csv --picture log.png
check bad/repeats.csv --json
check bad/backwards.csv
check bad/missing.csv --robot box.toml
check bad/nans.csv --robot box.toml
check bad/unsigned.csv --robot box.toml
check bad/saturated.csv --robot box.toml
check bad/short.csv
check bad/odd.csv
check bad/text.csv
check bad/infinite.csv --skip-bad-rows
check bad --robot box.toml
check bad --robot box.toml --json
check duty.csv --robot duty.toml --json
check counts.csv --assume a=ticks/25 --robot box.toml --json
check loopvolts.csv --robot loop.toml --json
check ellipse.csv --robot ellipse.toml
check rest.csv --robot box.toml
check dialect/motor.csv --robot box.toml --column w1=m1vel:rpm@motor --save-map m.toml
check dialect/places.csv
check u.csv missing.csv full.csv
check log.zip log.npy log.json words.txt empty.csv
check full.csv --save-map full.csv --force
check full.csv --latency w=0.02 --latency w=x
check examples/robotino --robot robotino --assume a=ticks/2000
check examples/robotino --robot robotino --assume a=ticks/2000 --full --json
check real/odrive --column "t=timestep (8Hz):0.000125 s" --json
check real/udea --json
check real/udea/stage1_1.txt --assume u=% --robot axebot
check real/gray real/green --robot robotino --current-unsigned
check real/motors --robot robotino --json
"""

SIMULATE = """
simulate axebot u.csv -o run.csv --pose 1,-2,0.5 --twist 0.1,0,1
simulate robotino w.csv -o run.csv
simulate robotino c.csv --json
simulate four-wheel u4.csv -o -
simulate mecanum u4.csv --json
simulate box.toml u.csv --duration 1.25 -o run.csv
simulate box.toml one.csv --duration 0.5 -o run.csv
simulate disc.toml u.csv -o run.csv
simulate ellipse.toml u.csv -o run.csv --tol 1e-8
simulate ellipse.toml u.csv -o run.csv --tol 0
simulate mixed.toml u.csv -o run.csv
simulate unequal.toml u.csv -o run.csv
simulate limits.toml u.csv -o run.csv
simulate dynamic.toml u.csv -o run.csv
simulate dynamicmixed.toml u.csv -o run.csv --tol 1e-5
simulate duty.toml d.csv -o run.csv
simulate coast.toml d.csv -o run.csv
simulate coast.toml ds.csv --json
simulate loop.toml w.csv -o run.csv
simulate loop.toml c.csv -o run.csv
simulate loopdisc.toml c.csv --json
simulate free.toml u.csv -o run.csv
simulate box.toml floor/smooth1.csv -o run.csv
simulate box.toml u.csv -o run.parquet
simulate axebot low.csv
simulate axebot high.csv --json
simulate axebot u4.csv
simulate axebot w.csv
simulate axebot d.csv
simulate axebot one.csv
simulate axebot empty.csv
simulate axebot nan.csv
simulate axebot inf.csv
simulate axebot cells.csv
simulate axebot back.csv
simulate axebot twice.csv
simulate axebot names.csv
simulate axebot none.csv
simulate axebot u.csv --pose 0,0
simulate axebot u.csv --twist 1;2;3
simulate axebot u.csv --max-steps 2
simulate axebot u.csv --tol -1
simulate axebot u.csv -o none/run.csv
simulate axebot u.csv -o u.csv
simulate axebot u.csv -o - --json
"""

IDENTIFY = """
identify floor/smooth1.csv --robot guess.toml -o fit.toml --report r.html
identify floor/smooth1.csv floor/smooth2.csv --robot guess.toml --hold-out smooth2* --json
identify floor/smooth1.csv --robot guess.toml --nuisance none --free friction --free motor.torque_constant_Nm_A --json
identify floor/smooth1.csv --robot box.toml --free body.mass_kg --free motor.resistance_ohm --fix body.mass_kg
identify floor/smooth1.csv --robot box.toml --nuisance latency --nuisance gain --nuisance dead_band --json
identify floor/smooth1.csv --robot box.toml --nuisance fade --nuisance tilt --json
identify floor/smooth1.csv --robot prior.toml --nuisance none --json
identify floor/smooth1.csv --robot box.toml --nuisance none --profile friction.axes.coulomb[0] --json
identify floor/smooth1.csv --robot box.toml --start free --nuisance none
identify floor/smooth1.csv --robot box.toml --start rest --nuisance none --latency twist=0.02
identify boot --robot box.toml --nuisance none --bootstrap 20 --json
identify boot --robot box.toml --nuisance none --bootstrap 2
identify bad/wild.csv --robot box.toml --nuisance none --loss student-t --json
identify bad/gap.csv --robot box.toml --nuisance none --json
identify bad/missing.csv --robot box.toml --nuisance none
identify bad/swapped.csv --robot box.toml --nuisance none
identify bad/late.csv --robot guess.toml --json
identify full.csv --robot guess.toml --json
identify pose.csv --robot guess.toml --nuisance none --json
identify wheel_speed.csv --robot guess.toml --nuisance none --json
identify current.csv --robot guess.toml --nuisance none --json
identify wheel_angle.csv --robot guess.toml --nuisance none --json
identify counts.csv --assume a=ticks/25 --robot guess.toml --nuisance none --json
identify duty.csv --robot duty.toml --json
identify dutyonly.csv --robot duty.toml --json
identify coast.csv --robot coast.toml --nuisance none --json
identify loop.csv --robot loop.toml --nuisance none --json
identify loop.csv --robot loop.toml --nuisance none --free friction --free drive.kp_V_s_rad --json
identify loopvolts.csv --robot loop.toml --method output-error --nuisance none
identify sticky.csv --robot sticky.toml --nuisance none --free friction --free friction.axes.breakaway[0] --json
identify disc.csv --robot disc.toml --nuisance none --report r.html -o fit.toml
identify ellipse.csv --robot ellipse.toml --json
identify wheels.csv --robot wheels.toml --nuisance none --json
identify mixed.csv --robot mixed.toml --nuisance none
identify unequal.csv --robot unequal.toml --nuisance none
identify limits.csv --robot limits.toml --nuisance none --json
identify dynamic.csv --robot dynamic.toml --nuisance none --json
identify dynamicmixed.csv --robot dynamicmixed.toml --nuisance none
identify floor --robot box.toml --per smooth=smooth* --per rough=rough* --nuisance none --json -o f.toml
identify floor --robot box.toml --per s=smooth* --per r=rough* --per-free friction.axes.coulomb[0] --report r.html
identify floor --robot box.toml --per s=smooth* --per r=rough* --nuisance none --profile friction.axes.coulomb[0]
identify floor --robot box.toml --per s=smooth* --per r=rough* --bootstrap 20
identify inputless.csv --robot box.toml
identify rest.csv --robot box.toml
identify floor/smooth1.csv
identify floor/smooth1.csv --robot box.toml --free body.weight
identify floor/smooth1.csv --robot box.toml --nuisance wind
identify floor/smooth1.csv --robot box.toml --loss huber
identify floor/smooth1.csv --robot box.toml --start moving
identify floor/smooth1.csv --robot box.toml --method steady-state --free friction
identify floor/smooth1.csv --robot box.toml --method output-error --shape disc
identify floor/smooth1.csv --robot box.toml --hold-out *.csv
identify floor/smooth1.csv --robot box.toml --per a=smooth*
identify floor/smooth1.csv --robot box.toml -o box.toml
identify floor/smooth1.csv --robot box.toml -o floor/smooth1.csv --force
identify floor/smooth1.csv --robot box.toml -o f.toml && compare floor/smooth2.csv --robot f.toml --robot box.toml
identify examples/robotino --robot robotino --current-unsigned --assume a=ticks/2000 --json
identify examples/robotino --robot robotino --current-unsigned --assume a=ticks/2000 --method output-error
"""

STEADY = """
identify examples/table1.csv --robot axebot -o fit.toml
identify examples/table1.csv --robot axebot --rest line --json
identify examples/table1.csv --robot axebot --rest ignore
identify stds.csv --robot axebot --json
identify noequal.csv --robot axebot
identify few.csv --robot axebot
identify badtable.csv --robot axebot
identify examples/table1.csv --robot axebot --method output-error
identify smooth --robot disc.toml --method steady-state -o fit.toml --report r.html
identify smooth rough --robot disc.toml --method steady-state --json -o fit.toml
identify smooth rough --robot disc.toml --method steady-state --report r.html
identify smooth --robot axebot --method steady-state --shape box --json
identify smooth --robot axebot --shape ellipse --speed set
identify smooth rough --robot axebot --shape line -o fit.toml
identify smooth --robot axebot --shape disc+wheel --force-from voltage --json
identify smooth --robot axebot --shape wheels+viscous --window 0.4,0.95 --json
identify . --robot axebot --shape disc --group smooth=smooth/* --group rough=rough --json
identify unsigned --robot axebot --shape auto --method steady-state
identify unsigned --robot axebot --shape auto --method steady-state --current-unsigned --json
identify smooth/run00.csv --robot axebot --method steady-state
identify smooth --robot axebot --shape round
identify smooth --robot axebot --window 0.9,0.4
identify smooth --robot axebot --group a=none
identify real/gray --robot robotino --current-unsigned --assume a=ticks/2000 -o fit.toml --report r.html
identify real/gray real/green --robot robotino --current-unsigned --assume a=ticks/2000 --speed set --json
identify bench3.csv --what motors --json --report m.html
identify bench1.csv bench2.csv --what motors --method output-error --hold-out bench2.csv --json --report m.html
identify bench1.csv --what motors --method output-error --between mean --nuisance none
identify bench1.csv --what motors --between curve --json
identify real/odrive/step1.csv --what motors --method output-error --column "t=timestep (8Hz):0.000125 s" --json
identify real/odrive --what motors --column "t=timestep (8Hz):0.000125 s" --json
identify real/udea/stage1_1.txt real/udea/stage1_2.txt --what motors --assume u=% --json
identify real/motors --what motors --robot robotino --current-unsigned --assume a=ticks/2000 --input current --json
"""

COMPARE = """
compare full.csv --robot box.toml
compare full.csv --robot box.toml --robot rough.toml --json
compare full.csv bad/gap.csv --robot box.toml --robot guess.toml --segments --picture p.png --show vx,w1
compare floor --robot box.toml --fail-if vx.rmse>0.05 --fail-if omega.rmse>0.001
compare duty.csv --robot duty.toml --json
compare coast.csv --robot coast.toml
compare loop.csv --robot loop.toml --json
compare loopvolts.csv --robot loop.toml --apply wheel_speed_command
compare loopvolts.csv --robot loop.toml --apply magic
compare smooth --robot loopdisc.toml --robot looprough.toml
compare ellipse.csv --robot ellipse.toml --json
compare dynamic.csv --robot dynamic.toml --robot box.toml --json
compare bad/unsigned.csv --robot box.toml --current-unsigned --json
compare bad/nans.csv --robot box.toml --hold 0
compare bad/late.csv --robot box.toml
compare inputless.csv --robot box.toml
compare full.csv --robot box.toml --fail-if vx.size>1
compare full.csv --robot box.toml --robot rough.toml --robot guess.toml
compare full.csv
compare examples/robotino/exp09.csv --robot robotino --current-unsigned --json
compare real/gray --robot robotino --current-unsigned --assume a=ticks/2000
"""

DIALECTS = """
check dialect/semicolon.csv --json
check dialect/utf16.csv
check dialect/tabs.tsv
check dialect/blanks.txt
check dialect/comments.csv --save-map m.toml
check dialect/headless.csv --no-header --column t=c1:s --column u1=c2:V --column u2=c3:V --column u3=c4:V
check dialect/units.csv --save-map m.toml
check dialect/dates.csv
check dialect/stamp.csv --json
check dialect/ticks.csv --assume a=ticks/2000 --assume u=V
check dialect/change.csv
check dialect/uneven.csv
"""

_TEXTS = (DEMO, ROBOTS, INIT, CHECK, SIMULATE, IDENTIFY, STEADY, COMPARE, DIALECTS)
COMMANDS = [line for text in _TEXTS for line in text.strip().splitlines()]

_CALLS = """
preset_names()
[(name, load_robot(name)) for name in preset_names()]
[load_robot(f"{name}.toml") for name in ("sticky", "mixed", "prior", "dynamicmixed", "loop")]
save_robot(load_robot("prior.toml"), "saved.toml")
save_robot(load_robot("prior.toml"), "box.toml")
load_robot("axbot")
[state_space(load_robot(name)) for name in preset_names()]
[[row.pattern for row in dead_zone(load_robot(name)).rows] for name in preset_names()]
[[row.scale for row in dead_zone(load_robot(name)).rows] for name in preset_names()]
[dead_zone(load_robot(f"{name}.toml"), [[1, -2, 0.5], [0, 0, 0]]).rows for name in ("mixed", "ellipse", "limits")]
dead_zone(load_robot("axebot"), [1, 2])
[dead_zone(load_robot(f"{name}.toml"), directions=np.arange(0, 6.3, 0.7)).voltage for name in ("box", "disc", "ellipse", "wheels")]
[dead_zone(load_robot(f"{name}.toml")).moving_axes(np.outer(np.arange(5), [0, 0.3, -0.3])) for name in ("box", "sticky", "mixed")]
acceleration(load_robot("box.toml"), [[0.1, 0.2, -1], [0, 0, 0]], [[1, 2, 3], [0.1, 0, 0]])
acceleration(load_robot("mixed.toml"), [[0.1, 0.2, -1], [0, 0, 0]], [[1, 2, 3], [0.1, 0, 0]])
acceleration(load_robot("ellipse.toml"), [0.1, 0, 0], [4, 1])
simulate(load_robot("axebot"), [[0, 3, -3]] * 200, 1e-3, twist=(0.1, -0.2, 1), pose=(1, 2, 3))
simulate(load_robot("box.toml"), [[0, 3, -3], [1, 1, 1]] * 40, [0.01, 0.03] * 40)
simulate(load_robot("dynamic.toml"), [[0, 3, -3], [1, 1, 1]] * 40, 0.01, current=(0.1, 0, -0.1))
simulate(load_robot("ellipse.toml"), [[0, 3, -3], [1, 1, 1]] * 40, 0.01, tol=None)
simulate(load_robot("coast.toml"), None, 0.01, duty=[[0, 0.5, -0.5], [0, 0, 0]] * 40, supply=6.0)
simulate(load_robot("loop.toml"), None, 0.01, twist_command=[[0.2, 0, 0.5]] * 80)
simulate(load_robot("axebot"), [[0, 3]], 1e-3)
simulate(load_robot("axebot"), [[0, 3, float("nan")]], 1e-3)
simulate(load_robot("axebot"), [[0, 3, 1]], -1e-3)
simulate(load_robot("axebot"), [[0, 3, 1]], 1e-3, duty=[[0, 0, 0]])
write_run(simulate(load_robot("mixed.toml"), [[0, 3, -3]] * 50, 0.01), "written.csv")
(write_run(read_log("full.csv"), "w.parquet"), read_log("w.parquet"), read_log("w.parquet") == read_log("full.csv"))
Run(t=[0, 1, 1])
Run(t=[0, 1, 2], voltage=[[1, 2]])
read_log("full.csv", load_robot("box.toml"))
read_log("bad/missing.csv")
read_log("dialect/motor.csv", load_robot("box.toml"), columns={f"w{k}": f"m{k}vel:rpm@motor" for k in (1, 2, 3)})
read_log("dialect/ticks.csv", assume={"a": "ticks/2000", "u": "V"}, latency={"a1": 0.015})
[read_log(f"dialect/{name}") for name in ("semicolon.csv", "utf16.csv", "units.csv", "stamp.csv", "change.csv")]
read_log("dialect/headless.csv", header=False, columns={"t": "c1:s", "u1": "c2:V"})
read_log("bad/backwards.csv")
read_log("bad/backwards.csv", sort=True)
read_log("bad/repeats.csv")
read_log("bad/text.csv")
read_log("bad/text.csv", skip_bad_rows=True)
read_log("bad/unsigned.csv", current_unsigned=True)
read_log("full.csv", assume={"u": "parsec"})
read_log("full.csv", columns={"u1": "wind:V"})
read_log("bad/nans.csv", recorded=True)
read_log("examples/robotino/exp00.csv", load_robot("robotino"), recorded=True)
read_log("log.zip", recorded=True)
check(read_log("bad/swapped.csv", recorded=True), load_robot("box.toml"))
check(read_log("bad/slip.csv", recorded=True), load_robot("box.toml"))
check(read_log("full.csv", recorded=True))
read_commands("c.csv", 3)
read_commands("ds.csv", 3, duration=1.2)
read_commands("back.csv", 3)
read_commands("u.csv", 3)
read_commands("d.csv", 3).voltage
read_steady_table("examples/table1.csv")
read_steady_table("stds.csv")
identify(read_steady_table("examples/table1.csv"), load_robot("axebot"), SteadyState(rest="line")).estimate
identify(read_steady_table("stds.csv"), load_robot("axebot"), SteadyState(absolute_std=True)).estimate
identify(read_steady_table("few.csv"), load_robot("axebot"), SteadyState()).estimate
identify(read_log("floor/smooth1.csv"), load_robot("guess.toml"), OutputError(nuisances=())).estimate
identify(read_log("floor/smooth1.csv"), load_robot("guess.toml"), OutputError(covariance="white", nuisances=["latency"])).estimate
identify(read_log("full.csv"), load_robot("box.toml"), OutputError(outputs=["twist", "heading"], nuisances=())).estimate
identify(read_log("wheel_angle.csv"), load_robot("box.toml"), OutputError(tick_rad=0.0126, nuisances=())).estimate
identify(read_log("wheel_angle.csv"), load_robot("box.toml"), OutputError(tick_rad=0.0, nuisances=())).estimate
identify(read_log("disc.csv"), load_robot("disc.toml"), OutputError(free=["friction.direction.coulomb[0]"], nuisances=())).estimate
identify(read_log("pose.csv"), load_robot("ellipse.toml"), OutputError(outputs=["pose"])).estimate
identify(read_log("counts.csv", assume={"a": "ticks/25"}), load_robot("box.toml"), OutputError(outputs=["wheel_angle"])).estimate
identify([read_log("floor/smooth1.csv")], load_robot("box.toml"), OutputError(nuisances=["tilt.x"], fixed=["friction.axes.viscous"])).estimate
identify([read_log(f"smooth/run{k:02d}.csv") for k in range(12)], load_robot("axebot"), SteadyState(shape="disc")).estimate
identify([read_log("full.csv")], load_robot("box.toml"), "magic")
identify([read_log(f"rough/run{k:02d}.csv") for k in range(12)], load_robot("axebot"), SteadyState(robust=False)).study
identify([read_log(f"floor/{n}.csv") for n in ("smooth1", "rough1")], load_robot("box.toml"), OutputError(nuisances=()), groups=[*"sr"])
identify([read_log("floor/smooth1.csv")], load_robot("box.toml"), OutputError(), groups=["a"])
identify([read_log("bench3.csv")], None, MotorLine()).study
identify([read_log("full.csv")], None, MotorLine(input="current", steady=True)).study
identify([read_log("floor/smooth1.csv")], None, MotorLine()).study
identify([read_log(f"real/udea/stage1_{k}.txt", assume={"u": "%"}) for k in (1, 2)], None, MotorLine()).study
[read_log(f"real/odrive/step{k}.csv", columns={"t": "timestep (8Hz):0.000125 s"}) for k in (1, 2)]
identify([read_log("pose.csv"), read_log("full.csv")], load_robot("box.toml"), OutputError(), hold_out="full.csv").validation.summary()
compare(load_robot("box.toml"), read_log("full.csv"), load_robot("rough.toml"), rng=3)
compare(load_robot("mixed.toml"), read_log("mixed.csv"), tol=1e-4)
compare(load_robot("four-wheel"), read_log("full.csv"))
"""  # noqa: E501  one case a line
CALLS = _CALLS.strip().splitlines()
