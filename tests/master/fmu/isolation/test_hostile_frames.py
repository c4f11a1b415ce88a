"""A child can say what it likes: nothing of it is executed, and nonsense is refused."""

from __future__ import annotations

import pickle
import socket
import struct
from threading import Thread

import numpy as np
import pytest

from master.errors import SlaveError
from master.fmu.isolation import isolated_instance
from master.fmu.isolation.channel import HEADER, LONGEST_TEXT, Answer, Channel, EndedError, ProtocolError
from master.fmu.isolation.isolated_instance import IsolatedInstance, Isolation


class Puppet:
    """A process that is none: the test says what the child says."""

    def __init__(self):
        ours, self.theirs = socket.socketpair()
        self.channel = Channel(ours)
        self.ended = 0

    def say(self, frame):
        self.theirs.sendall(frame)

    def how_it_ended(self):
        return "ended"

    def end(self, grace=1.0):
        self.ended += 1


@pytest.fixture
def puppet(monkeypatch, crasher):
    made = Puppet()
    monkeypatch.setattr(isolated_instance, "Process", lambda: made)
    instance = IsolatedInstance(crasher(), Isolation())
    instance.bind(np.zeros(1), np.zeros(1))
    return made, instance


def frame(what, rest, length=None):
    return HEADER.pack(what, 0, len(rest) if length is None else length) + rest


class Bomb:
    def __reduce__(self):
        return (print, ("boom",))


@pytest.mark.parametrize(
    "answer",
    [
        frame(Answer.DONE, b"", length=2**63),
        frame(Answer.FAILED, b"", length=LONGEST_TEXT + 1),
        frame(Answer.DONE, pickle.dumps(Bomb())),
        frame(7, b""),
        frame(Answer.DONE, b"") + b"more",
    ],
)
def test_nonsense_ends_the_child(puppet, answer, capsys):
    process, instance = puppet
    process.say(answer)
    with pytest.raises(SlaveError, match=r"component 'toy' \(Crasher\.fmu\) disturbed the exchange .* in loading"):
        instance.start(0.0, 1.0)
    assert process.ended == 1
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("count", [0, 1, 3])
def test_as_many_values_as_were_asked_for(puppet, count):
    """One output: its value comes after the time that the steps took, two numbers."""
    process, instance = puppet
    process.say(frame(Answer.DONE, b""))  # to loading
    instance.start(0.0, 1.0)
    process.say(frame(Answer.DONE, b""))
    instance.step(0.0, 0.1)
    process.say(frame(Answer.DONE, struct.pack(f"<{count}d", *range(count))))
    with pytest.raises(SlaveError, match="disturbed"):
        instance.read()


def test_texts_are_made_harmless(puppet):
    process, instance = puppet
    process.say(frame(Answer.FAILED, b"\x1b[2J\n\xff" + b"x" * 5000))
    with pytest.raises(SlaveError) as caught:
        instance.start(0.0, 1.0)
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) < 1000


def test_a_closed_connection_is_an_end(puppet):
    process, instance = puppet
    process.theirs.close()
    with pytest.raises(SlaveError, match="crashed in loading: its process ended"):
        instance.start(0.0, 1.0)


def test_a_channel_puts_pieces_together():
    ours, theirs = socket.socketpair()
    channel = Channel(ours)
    channel.reserve(4)  # less than what comes
    whole = frame(5, bytes(range(100)))

    def trickle():
        for i in range(0, len(whole), 7):
            theirs.sendall(whole[i : i + 7])

    with ours, theirs:
        writer = Thread(target=trickle)
        writer.start()
        assert channel.receive(100) == (5, 0, 100)
        assert channel.rest(100) == bytes(range(100))
        writer.join()
        theirs.sendall(frame(5, bytes(101)))
        with pytest.raises(ProtocolError):
            channel.receive(100)


def test_a_channel_says_when_the_other_side_is_gone():
    ours, theirs = socket.socketpair()
    theirs.close()
    with ours:
        with pytest.raises(EndedError):
            Channel(ours).receive(100)
        with pytest.raises(EndedError):
            Channel(ours).send(1)
