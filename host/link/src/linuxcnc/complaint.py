import linuxcnc

errors = linuxcnc.error_channel()


def complaint():
    """What LinuxCNC has said since the last call, unless it is only a message."""
    while True:
        said = errors.poll()
        if not said:
            return None
        kind, text = said
        if kind in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR) and "realtime delay" not in text:
            return text


