# SPDX-License-Identifier: BSD-3-Clause
"""Every word that the windows and the markers show, in one place.

The forms in `resource/*.ui` hold the keys of `WORDS` where their texts will be, and the code asks
for a text by the same keys, so there is no second place to translate. A translation is a gettext
catalogue: `pygettext3 words.py` extracts the texts, and `resource/locale/<language>/LC_MESSAGES/
fleet_manager.mo` holds them in another language, chosen by LANGUAGE or LANG.
"""

from __future__ import annotations

import gettext

from hive_common.resources import package_folder

_LOCALE = package_folder("fleet_manager") / "resource" / "locale"
_ = gettext.translation("fleet_manager", localedir=str(_LOCALE), fallback=True).gettext

WORDS = {
    "app.name": _("Robo-Hive fleet manager"),
    "app.entry": _("Task entry"),
    "app.view": _("Task view"),
    "app.about": _("A window onto a hive: the ROS master is found through ROS_MASTER_URI."),
    "app.example": _(
        "example, with the stations of a world to choose from:\n"
        "  rosrun fleet_manager {program} _world:=lab"
    ),
    "app.qt_arguments": _("arguments for Qt, after --"),
    "menu.view": _("&View"),
    "menu.appearance": _("&Appearance"),
    "menu.as_desktop": _("As the &desktop"),
    "menu.light": _("&Light"),
    "menu.dark": _("&Dark"),
    "menu.reset": _("&Reset the layout"),
    "menu.quit": _("&Quit"),
    "menu.file": _("&File"),
    "close.title": _("Not sent yet"),
    "close.text": _("{count} tasks have not been taken in yet. They are lost when you close."),
    # task types
    "type.GA": _("GA: go to A"),
    "type.GAB": _("GAB: go to A, then to B"),
    "type.GPA": _("GPA: go to A and pick there"),
    "type.GPAB": _("GPAB: pick at A, bring it to B"),
    # task entry
    "entry.id": _("&Id"),
    "entry.id_tip": _("A name for the task; the next free number is proposed."),
    "entry.type": _("&Type"),
    "entry.type_tip": _("What a robot does at which goals."),
    "entry.priority": _("&Priority"),
    "entry.priority_tip": _("0 is the lowest; 10 is the highest and may interrupt others."),
    "entry.payload": _("Pay&load"),
    "entry.payload_tip": _("Mass of what is carried."),
    "entry.kg": _("kg"),
    "entry.priority_range": _("0 to 10"),
    "entry.send": _("&Send task"),
    "entry.send_tip": _("Send the task to the hive (Enter)."),
    "entry.clear": _("&Clear"),
    "entry.clear_tip": _("Empty the form (Esc)."),
    "entry.sent": _("Sent from here"),
    "entry.sent_tip": _("What became of the tasks that were sent from this window."),
    "entry.fix": _("Not sent: mend the marked fields."),
    "goal.title": _("Goal {name}"),
    "goal.optional": _("Goal {name} (may be left empty)"),
    "goal.place": _("Place"),
    "goal.place_tip": _("A station or charger of the world, instead of coordinates."),
    "goal.coordinates": _("by coordinates"),
    "goal.x": _("x"),
    "goal.y": _("y"),
    "goal.heading": _("heading"),
    "goal.m": _("m"),
    "goal.degree": _("°"),
    "goal.x_tip": _("Distance along the map's x axis."),
    "goal.y_tip": _("Distance along the map's y axis."),
    "goal.heading_tip": _("Counter-clockwise from the x axis; empty means 0°."),
    "goal.pick": _("Pick &{name} on map"),
    "goal.pick_tip": _("Then click with RViz's Publish Point. 2D Nav Goal also sets the heading."),
    "pick.armed": _("Goal {name}: click in RViz with Publish Point, or drag with 2D Nav Goal."),
    "pick.next": _("Goal {filled} is filled. Goal {name}: click in RViz with Publish Point."),
    "pick.done": _("Goal {filled} is filled. A drag with 2D Nav Goal there sets its heading."),
    "pick.heading": _("The heading of goal {filled} is set."),
    "pick.frame": _(
        "The click came in frame {frame}; set the Fixed Frame of RViz to {wanted} and click again."
    ),
    # mistakes in fields
    "bad.empty": _("is empty; allowed: {allowed}"),
    "bad.number": _("“{text}” is not a number; allowed: {allowed}"),
    "bad.range": _("{text} is outside; allowed: {allowed}"),
    "bad.id": _("“{text}” has characters that do not belong; allowed: {allowed}"),
    "bad.taken": _("{text} is taken already; propose: {proposal}"),
    "allowed.id": _("1 to {longest} letters, digits, - and _"),
    "allowed.range": _("{low} to {high} {unit}"),
    "allowed.map": _("{low} to {high} {unit}, the map ends there"),
    # what became of a sent task
    "sent.KEPT": _("{id}: kept here; it is sent as soon as there is a blackboard"),
    "sent.WAITS": _("{id}: sent, waiting for the answer"),
    "sent.TAKEN": _("{id}: taken in"),
    "sent.REFUSED": _("{id}: refused: {reason}"),
    "sent.no_reason": _("no reason was given"),
    # who carries the blackboard
    "authority.no_master": _("No ROS master at {master}. Start the hive; this window connects."),
    "authority.lost_master": _("The ROS master at {master} does not answer; what runs goes on."),
    "authority.NOBODY": _("No blackboard: nobody takes tasks in or gives them out."),
    "authority.SILENT": _(
        "No blackboard: {leader} has been silent for {silence}. Tasks and robots wait for one."
    ),
    "authority.STUCK": _("Blackboard stuck: {leader} answers but does not work."),
    "authority.LEADER": _("Blackboard: {leader}"),
    "authority.backup": _("Backup: {backup}"),
    "authority.no_backup": _("Backup: none"),
    "authority.epoch": _("Epoch {epoch}"),
    # task states
    "task.WAITING": _("waiting"),
    "task.ASSIGNED": _("assigned"),
    "task.STARTED": _("started"),
    "task.DONE": _("done"),
    "task.REJECTED": _("rejected"),
    "task.CANCELLED": _("cancelled"),
    "task.FAILED": _("failed"),
    "robot.IDLE": _("idle"),
    "robot.BUSY": _("busy"),
    "robot.DEFECT": _("defect"),
    "robot.CHARGING": _("charging"),
    "robot.OFFLINE": _("offline"),
    # task view
    "view.tasks": _("&Tasks"),
    "view.robots": _("&Robots"),
    "view.log": _("&Log: what happened"),
    "view.filter": _("&Filter"),
    "view.filter_hint": _("part of an id, a robot, a type or a reason"),
    "view.show": _("S&how"),
    "view.all": _("all tasks"),
    "view.open": _("open tasks"),
    "view.ended": _("ended tasks"),
    "view.count": _("{shown} of {total} tasks"),
    "view.cancel": _("&Cancel task"),
    "view.cancel_tip": _("Take the selected open tasks off the list (Del)."),
    "view.again": _("Send a&gain"),
    "view.again_tip": _("Post the same under a new id."),
    "view.details": _("Detai&ls"),
    "view.details_tip": _("Goals, history and the bids that decided it (Enter)."),
    "view.defect": _("Set &defect"),
    "view.defect_tip": _("Take the selected robots out of service."),
    "view.service": _("&Back in service"),
    "view.service_tip": _("Put the selected robots back in service."),
    # table heads
    "column.id": _("Task"),
    "column.state": _("State"),
    "column.type": _("Type"),
    "column.robot": _("Robot"),
    "column.step": _("Step"),
    "column.progress": _("Progress"),
    "column.eta": _("Done in"),
    "column.priority": _("Priority"),
    "column.payload": _("Payload"),
    "column.age": _("Age"),
    "column.reason": _("Reason"),
    "column.battery": _("Battery"),
    "column.load": _("Load"),
    "column.place": _("Place"),
    "column.current": _("Current task"),
    "column.queue": _("Queue"),
    # details
    "details.title": _("Task {id}"),
    "details.close": _("&Close"),
    "details.what": _("What was asked for"),
    "details.where": _("Where it stands"),
    "details.bids": _("Bids of the last auction it was in"),
    "details.goal": _("{name}: x {x}, y {y}, heading {heading}"),
    "details.asked": _("{type}, priority {priority}, payload {payload}"),
    "details.stands": _("{state}, robot {robot}, step {step} of {steps}"),
    "details.part": _("Part of {parent}"),
    "details.reason": _("Reason: {reason}"),
    "details.no_bids": _(
        "No bid has been seen since the program was started, and none is noted on this machine."
    ),
    "details.helps": _("What would help: {what}"),
    "details.offered": _("Auctions it was seen in: {auctions}. Times given out: {times}."),
    "details.tried": _("Tried in vain by {robots}."),
    "details.nobody": _("none"),
    "bid.robot": _("Robot"),
    "bid.cost": _("Cost (0 to 1000)"),
    "bid.way": _("Way"),
    "bid.place": _("Place"),
    "bid.energy": _("Charge"),
    "bid.left": _("Charge left"),
    "bid.eta": _("Done in"),
    "bid.reason": _("Why not"),
    "bid.won": _("{robot} (has it)"),
    # values
    "value.seconds": _("{seconds} s"),
    "value.minutes": _("{minutes} min {seconds:02d} s"),
    "value.hours": _("{hours} h {minutes:02d} min"),
    "value.days": _("{days} d {hours:02d} h"),
    "value.unknown": _("–"),
    "value.position": _("{x:.2f} m, {y:.2f} m"),
    "value.step": _("{step} of {steps}"),
    "value.charge": _("{charge}"),
    "value.low": _("{charge} low"),
    "value.late": _("late by {time}"),
    # markers
    "marker.goal": _("{id} {name}"),
    "marker.robot": _("{robot}: {state}\nload {load}, battery {charge}"),
    # log
    "log.posted": _("{id} was posted: {type}, priority {priority}"),
    "log.first_list": _("{count} tasks are on the list, {open} of them open"),
    "log.WAITING": _("{id} waits for a robot"),
    "log.waits_because": _("{id} waits: {reason}"),
    "log.handed_back": _("{id} is no longer with {robot} and waits"),
    "log.ASSIGNED": _("{id} was given to {robot}"),
    "log.assigned_by_cost": _("{id} was given to {robot} at cost {cost:.1f} ({others})"),
    "log.other_bid": _("{robot} {cost:.1f}"),
    "log.other_refuses": _("{robot} cannot"),
    "log.STARTED": _("{robot} started {id}"),
    "log.step": _("{robot} has done step {step} of {steps} of {id}"),
    "log.DONE": _("{id} is done by {robot}"),
    "log.REJECTED": _("{id} was refused: {reason}"),
    "log.CANCELLED": _("{id} was cancelled"),
    "log.FAILED": _("{id} failed: {reason}"),
    "log.removed": _("{id} is no longer on the list"),
    "log.robot_new": _("{robot} is here: {state}"),
    "log.robot_state": _("{robot} is {state}"),
    "log.robot_because": _("{robot} is {state}: {reason}"),
    "log.robot_lost": _("{robot} has not been heard of for {silence}"),
    "log.robot_back": _("{robot} is heard again"),
    "log.leader": _("{leader} carries the blackboard (epoch {epoch})"),
    "log.taken_over": _("{leader} took the blackboard over from {before} (epoch {epoch})"),
    "log.backup": _("{backup} is the backup"),
    "log.no_backup": _("There is no backup"),
    "log.silent": _("Nobody carries the blackboard: {leader} is silent"),
    "log.stuck": _("The blackboard of {leader} is stuck"),
    "log.heard_again": _("{leader} carries the blackboard again (epoch {epoch})"),
    "log.link_up": _("Connected to the ROS master at {master}"),
    "log.link_lost": _("The ROS master at {master} does not answer"),
    "log.asked_cancel": _("Asked to cancel {id}"),
    "log.asked_state": _("Asked {robot} to be {state}"),
}


def text(key: str, **values: object) -> str:
    """Return a text in the operator's language.

    Args:
        key: Its name in `WORDS`.
        **values: What the text has in braces.

    Raises:
        KeyError: There is no such text, or a value is missing: a fault of the program.
    """
    return WORDS[key].format(**values) if values else WORDS[key]
