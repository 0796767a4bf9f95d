"""Opening the port that an entry of ``timing_marks`` names."""

from __future__ import annotations

from devices.timing_marks.port import MarkPort
from devices.timing_marks.spec import LslMarksSpec, MarksSpec, SerialMarksSpec


def open_mark_port(spec: MarksSpec) -> MarkPort:
    """Open the port of ``spec``; only the library that it needs is imported.

    Parameters
    ----------
    spec
        An entry of a rig's ``timing_marks``.

    Returns
    -------
    MarkPort
        The open port, which no other program has.

    Raises
    ------
    MarkError
        If it cannot be opened; the message names the port and what to do.

    Examples
    --------
    >>> from devices.timing_marks import SerialMarksSpec
    >>> from documents import InputError
    >>> try:
    ...     open_mark_port(SerialMarksSpec(kind="serial", port="/dev/none"))
    ... except InputError as error:
    ...     print(error.findings[0].message)
    there is no such serial port
    """
    if isinstance(spec, LslMarksSpec):
        from devices.timing_marks.lsl_stream import LslStream

        return LslStream(spec)
    if isinstance(spec, SerialMarksSpec):
        from devices.timing_marks.serial_port import SerialPort

        return SerialPort(spec)
    from devices.timing_marks.parallel_port import ParallelPort

    return ParallelPort(spec)
