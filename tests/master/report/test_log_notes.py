"""What is logged in a command's process becomes notes of the command."""

import logging

from master.report.log_notes import show_log


def test_every_message_is_told_once_and_only_to_who_asked_last():
    first, last = [], []
    logger = logging.getLogger("openpanto")
    handlers, level = logger.handlers[:], logger.level
    try:
        show_log(first.append)
        show_log(last.append)
        for _ in range(2):
            logger.info("compiling %s", "kernels")
        logger.warning("warning: a folder")
        logger.debug("nothing for users")
    finally:
        logger.handlers[:] = handlers
        logger.setLevel(level)
    assert first == []
    assert last == ["compiling kernels", "warning: a folder"]
