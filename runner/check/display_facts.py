"""What of a rig was measured, and what is nominal, assumed or unknown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from devices.display import NOT_MEASURED, Nominal, Rig
from documents import Finding
from runner.check.report import CheckReport
from runner.presenter.modes.options import ModeOptions
from runner.presenter.modes.registry import find_mode
from runner.session.timing_record import NOT_VERIFIED

SETTINGS_REMEDY = "set the monitor as it was measured, or measure it as it is used"


def check_display_facts(report: CheckReport, rig: Rig) -> None:
    """Report what of the rig was not measured, in a line, and warn of what its colours and times depend on."""
    check_nominal(report, rig.nominal)
    report.facts["not_measured"] = list(not_measured(rig))
    check_onsets(report, rig)
    check_settings(report, rig)
    check_mirror(report, rig)


def not_measured(rig: Rig) -> tuple[str, ...]:
    """Return in phrases what of the rig is nominal, assumed or unknown."""
    return tuple(_not_measured(rig))


def _not_measured(rig: Rig) -> Iterator[str]:
    nominal, models = rig.nominal, rig.models
    options = ModeOptions.parse(rig.spec.mode_options)
    if nominal:
        yield f"colours (nominal {nominal.name})"
        if nominal.black_assumed:
            yield f"black ({nominal.black_cd_m2:.3g} cd/m² assumed)"
        if nominal.panel_from:
            yield "size of the panel (as the monitor reports it)"
        if rig.spec.glasses:
            yield f"light that the glasses take ({rig.spec.glasses})"
    through = find_mode(rig.mode, options).seen_through(models)
    if through and through.assumed:
        which = "filters of the glasses" if len(through.assumed) == 2 else f"filter before the {through.assumed[0]} eye"
        yield f"{which} (round figures)"
    if rig.crosstalk is None and rig.mode != "flat":
        yield "crosstalk"
    if rig.gain_map is None:
        yield "evenness of the panel"
    if not any(model.ambient_XYZ_cd_m2.any() for model in (models.left, models.right)):
        yield "the room's light"
    if not nominal and not all(table.known for table in rig.measured_gamma_tables.values()):
        yield "gamma table of the measurement"
    if not (rig.spec.monitor_settings or rig.measured_settings):
        yield "settings of the monitor"
    if rig.verification is None:
        yield "onsets"


def check_nominal(report: CheckReport, nominal: Nominal | None) -> None:
    """Report that a display is nominal, and warn of it: every colour depends on it."""
    if nominal is None:
        return
    report.facts["display"] = f"{NOT_MEASURED}: {nominal.words}"
    what = f"the display is {NOT_MEASURED}: its colours are those of a standard, not of this display"
    report.warnings.append(Finding(what, str(report.file), remedy=nominal.next_step))


def check_onsets(report: CheckReport, rig: Rig) -> None:
    """Report whether onsets were verified with a photodiode, and where that record differs from the rig."""
    verification = rig.verification
    if verification is None:
        report.facts["onsets"] = NOT_VERIFIED
        return
    differs = verification.mismatches(mode=rig.mode, refresh_hz=rig.display.panel.refresh_hz)
    report.facts["onsets"] = NOT_VERIFIED if differs else verification.sentence()
    if differs:
        what = f"{Path(verification.file).name} does not hold for this rig: {'; '.join(differs)}"
        report.warnings.append(Finding(what, rig.file, remedy="measure again, or leave it out"))


def check_mirror(report: CheckReport, rig: Rig) -> None:
    """Report the folder that results are copied to, and warn if it is not there now."""
    if rig.mirror is None:
        return
    report.facts["results_mirror"] = str(rig.mirror)
    if not rig.mirror.is_dir():
        what = f"results_mirror: there is no folder {rig.mirror}: a session is not copied until it is there"
        report.warnings.append(Finding(what, rig.file, remedy="connect the disk, or make the folder"))


def check_settings(report: CheckReport, rig: Rig) -> None:
    """Report the monitor's settings, and where they differ from those measured with, or change the light."""
    if rig.spec.monitor_settings:
        report.facts["monitor_settings"] = rig.spec.monitor_settings.words
    elif rig.measured_settings:
        report.facts["monitor_settings"] = f"measured with {rig.measured_settings.words}; the rig does not state them"
    report.warnings.extend([Finding(words, rig.file, remedy=SETTINGS_REMEDY) for words in rig.settings_doubts])
