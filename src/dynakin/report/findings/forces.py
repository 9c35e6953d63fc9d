"""Plates, mass and moments: what is measured, and what contradicts it."""

from __future__ import annotations

from dynakin.messages import about
from dynakin.recordings.feet.contact import NO_CONTACT, SHARED_PLATE
from dynakin.report.findings.finding import Insight, Metrics
from dynakin.report.labels import COMPONENT_LABELS
from dynakin.results.estimate import Estimate
from dynakin.results.naming import listed, number, plural, sentence

# Part of what contacts give, of the weight at least, that none of them gives, from which it is said: good recordings
# leave 0.03 to 0.16 for a frame, one frame that was filled 0.4.
LEFT = 0.25
# What to do, in the words of a laboratory.
ADVICE = {
    "left": "Look in the recording at that time for markers that jump or frames that were filled; moments there are "
    "wrong.",
}


def moments(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """Why moments are not measured, and what that leaves out; how many are is said before all findings."""
    found = metrics["moments"]
    if all(count["measured"] == found["frames"] for count in found["legs"].values()):
        return None
    text = ["Peaks, work, symmetry and mean curves are of measured moments only."]
    if any(count["absent"] for count in found["legs"].values()):
        text.append("Absent moments, powers and joint reactions are nan in the files.")
    flagged = {"derived": "derived ones (dashed in the figures)", "prior": "those that take a prior (dotted)"}
    if shown := [how for meaning, how in flagged.items() if any(count[meaning] for count in found["legs"].values())]:
        text.append(f"{sentence(listed(shown))} are in the files with their flag (moments_source.sto).")
    text += found["reasons"][:3]
    if len(found["reasons"]) > 3:
        text.append(f"{plural(len(found['reasons']) - 3, 'more reason')} under Joint moments.")
    advice = "Give the forces of every contact (--forces), and plates under every step that is to be judged."
    shared, always = _sharing(estimate)
    if shared:
        advice = "Record it with each foot on a plate of its own."
    if always:
        each = listed([f"the {name}{' foot' if name in ('right', 'left') else ''}" for name in always])
        share, bear = ("shares", "it bears") if len(always) == 1 else ("share", "they bear")
        text.insert(0, f"{sentence(each)} {share} a plate whenever {bear}: moments are guesses then.")
    # steps off the plates are usual and flagged; a leg without a measured frame is not what was recorded for
    missed = always or any(not count["measured"] for count in found["legs"].values())
    return Insight("warning" if missed else "note", "Joint moments", " ".join(text), advice)


def _sharing(estimate: Estimate) -> tuple[bool, list[str]]:
    """Whether any foot shares a plate with another, and those that do whenever they stand."""
    if "foot_contact" not in estimate.data:
        return False, []
    contact = estimate.values("foot_contact")
    shares, stands = contact == SHARED_PLATE, contact != NO_CONTACT
    always = shares.any(axis=0) & (shares | ~stands).all(axis=0)
    return bool(shares.any()), [name for name, own in zip(estimate.contact_names, always, strict=True) if own]


def left(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """A force that no contact gives while the feet are on plates: a jump in the motion, as a filled frame makes one."""
    feet = metrics["feet"]
    largest = feet and feet["left_at_root"]["grounded"]
    if not largest or largest["share"] < LEFT:
        return None
    text = (
        f"At one time the motion needs {number(largest['force_n'], 'N')} more or less than the feet's plates give "
        f"(up to {number(100.0 * largest['share'], '%', digits=2)} of the weight, or of what they give where that is "
        "more)."
    )
    return Insight("warning", "Left at the pelvis", text, ADVICE["left"], ("sum of the plates",))


def wrench(estimate: Estimate, metrics: Metrics) -> Insight | None:
    """How far the model's total wrench is from the plates'."""
    rms = metrics["wrench"]["rms"]
    about_plates = [message.text for message in about(estimate.messages, "sum of the plates", "in step")]
    if not rms:
        why = " ".join(about_plates) or "No wrench was compared: none was measured, or none is modelled."
        return Insight("note", "Force plates", why)
    text = [
        f"{COMPONENT_LABELS[name][0].lower()} {number(value, COMPONENT_LABELS[name][1])}"
        + (f" ({number(share, digits=2)} %)" if (share := metrics["wrench"]["nrms_percent"][name]) is not None else "")
        for name, value in rms.items()
    ]
    return Insight(
        "note",
        "Force plates",
        f"RMS difference between the model’s wrench and the plates’: {listed(text)}; percent of the measured RMS."
        + "".join(f" {sentence}" for sentence in about_plates),
    )
