"""What is said of a drive: how far it went, and why it was stopped."""

from __future__ import annotations

from omnidyn.telling.sentence import Sentence

SENTENCES = {
    "drive_program": Sentence(
        "{legs} legs in {seconds:.1f} s for {subject}: up to {reach[0]:.2f} m along x and {reach[1]:.2f} m along y, in "
        "{area[0]:g} m x {area[1]:g} m"
    ),
    "drive_complete": Sentence("{subject} drove the whole program: {all_legs} legs in {seconds:.1f} s"),
    "drive_stopped": Sentence("stopped after {seconds:.1f} s and {legs} of {all_legs} legs: {why}"),
    "drive_no_answer": Sentence(
        "the robot does not answer within {seconds:g} s",
        "check that its program runs, that the cable or address is right, and that nobody else holds the port",
    ),
    "drive_slow_line": Sentence(
        "an answer takes {seconds:m.0f} ms, and may take {most:m.0f} ms",
        "use a faster line, let the robot measure more often, or allow a longer dead-man time with `dead_man`",
    ),
    "drive_silent": Sentence(
        "the robot measured nothing for {seconds:m.0f} ms",
        "look at the line and at the program of the robot, then drive the rest with `resume`",
    ),
    "drive_late": Sentence(
        "no command arrived for {seconds:m.0f} ms",
        "look at the line, then drive the rest with `resume`",
    ),
    "drive_reset": Sentence(
        "the robot began anew in the middle of the drive",
        "look at its supply: a battery that sags resets its computer; then drive the rest with `resume`",
    ),
    "drive_clock": Sentence(
        "the clock of the robot jumped by {jump:.3g} s", "let it stamp by a clock that nobody sets, then start anew"
    ),
    "drive_border": Sentence(
        "it would be {place:.2f} m along {subject}, and the border is at {border:.2f} m",
        "put it back into the middle, and drive the rest with `resume`; it goes farther than planned: plan for a robot "
        "that is known better, or give a smaller `area` to plan",
    ),
    "drive_wrong_way": Sentence(
        "wheel {wheel} turns the other way than it was asked to",
        "swap the two wires of its motor or the sign in its driver, and see that wheels are counted as in the robot "
        "file",
    ),
    "drive_stuck": Sentence(
        "wheel {wheel} does not turn as it was asked to",
        "look at its motor, driver and encoder; a floor much rougher than the robot file says looks the same",
    ),
    "drive_slip": Sentence(
        "wheel {wheel} turns otherwise than the body moves: it slips, or a sensor is wrong",
        "clean the wheels, take a rougher floor or a lower input, and check the geometry of the robot file",
    ),
    "drive_supply": Sentence(
        "the supply is {volts:.1f} V, and the least is {least:.1f} V",
        "charge the battery, then drive the rest with `resume`",
    ),
    "drive_released": Sentence("the key was released", "drive the rest with `resume`"),
    "drive_by_hand": Sentence("it was stopped by hand", "drive the rest with `resume`"),
    "drive_terminated": Sentence("this program was told to end", "drive the rest with `resume`"),
    "drive_call_failed": Sentence(
        "`{subject}` failed: got {error}; expected a function that returns",
        "mend it, then drive the rest with `resume`; `error` of the record has where it failed",
    ),
    "drive_failed": Sentence(
        "what came from the robot could not be taken: {error}",
        "mend the connection, or report it if it is not yours; then drive the rest with `resume`",
    ),
    "drive_slow_loop": Sentence(
        "this computer was held up for {seconds:m.0f} ms", "end other programs, then drive the rest with `resume`"
    ),
    "drive_line_broke": Sentence(
        "the line to the robot broke: {error}", "plug it in again, and drive the rest with `resume`"
    ),
}
