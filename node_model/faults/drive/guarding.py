"""Drives whose node guarding or life guarding is wrong (EC-01 to EC-03, C-NG)."""

from __future__ import annotations

from node_model.faults.parts import Fault
from node_model.frame import Frame
from node_model.guarding import LIFE_TIME_FACTOR, NodeGuarding
from node_model.nmt import NmtState
from node_model.node import MS, Frames


class GuardingBesideHeartbeat(Fault, NodeGuarding):
    """Polls are answered although there is a heartbeat."""

    violates = ("EC-03", "C-HB-10")

    def serves(self) -> bool:
        return True


class GuardingToggleBeginsWithOne(Fault, NodeGuarding):
    """The toggle bit of the first answer is 1."""

    violates = ("EC-01", "C-NG-03")

    def first_toggle(self) -> int:
        return 0x80


class GuardingToggleStands(Fault, NodeGuarding):
    """The toggle bit of the answers does not alternate."""

    violates = ("EC-01", "C-NG-02", "C-NG-03")

    def next_toggle(self) -> int:
        return self._toggle


class GuardingToggleEverySecondAnswer(Fault, NodeGuarding):
    """The toggle bit changes after every second answer."""

    violates = ("EC-01", "C-NG-02", "C-NG-03")

    answers = 0

    def next_toggle(self) -> int:
        self.answers += 1
        return self._toggle if self.answers % 2 else super().next_toggle()


class GuardingToggleSurvivesReset(Fault, NodeGuarding):
    """The toggle bit goes on after a reset of communication."""

    violates = ("EC-01", "C-NG-04", "C-NG-03")

    def first_toggle(self) -> int:
        return self._toggle


class GuardingToggleResetByState(Fault, NodeGuarding):
    """A change of the NMT state resets the toggle bit."""

    violates = ("EC-01", "C-NG-04")

    def enter(self, state: NmtState, now: int) -> Frames:
        self._toggle = 0
        return super().enter(state, now)


class GuardingShowsPreOperational(Fault, NodeGuarding):
    """Answers to polls show pre-operational in every state."""

    violates = ("EC-01", "C-NG-10", "C-NG-02")

    def enter(self, state: NmtState, now: int) -> Frames:
        return super().enter(NmtState.PRE_OPERATIONAL, now)


class GuardingSilentInStopped(Fault, NodeGuarding):
    """Polls are not answered in stopped."""

    violates = ("EC-01", "C-NG-02", "C-NG-10")

    def serves(self) -> bool:
        return super().serves() and self.state is not NmtState.STOPPED


class GuardingAnswersForTheNext(Fault, NodeGuarding):
    """Polls of the next node are answered, too."""

    violates = ("C-NG-09", "C-HB-06")

    def listens_to(self) -> frozenset[int]:
        return super().listens_to() | {0x701 + self.node_id}


class GuardingAnswerOfTwoBytes(Fault, NodeGuarding):
    """Answers to polls have two bytes."""

    violates = ("EC-01", "C-NG-02", "C-RB-02")

    def answer(self) -> Frame:
        frame = super().answer()
        return Frame(frame.can_id, frame.data + b"\0")


class LifeGuardingWithoutPoll(Fault, NodeGuarding):
    """Life guarding begins with the boot-up instead of the first poll."""

    violates = ("EC-02", "C-NG-05")

    def _written(self, sub: int, now: int) -> None:
        super()._written(sub, now)
        if self.serves() and self.life_ns() and self.running:
            self._lapse_at = now + self.life_ns()


class LifeGuardingIsMissing(Fault, NodeGuarding):
    """Polls that do not come have no consequence."""

    violates = ("EC-02", "C-NG-06")

    def life_ns(self) -> int:
        return 0


class LifeTimeWithoutFactor(Fault, NodeGuarding):
    """The life time is the guard time alone."""

    violates = ("EC-02", "C-NG-01", "C-NG-07", "C-NG-11")

    def life_ns(self) -> int:
        return super().life_ns() // (self._od.number(LIFE_TIME_FACTOR) or 1)


class LifeTimeTooLong(Fault, NodeGuarding):
    """The life time is half as long again as it should be."""

    violates = ("EC-02", "C-NG-07", "C-NG-01", "C-NG-11")

    def life_ns(self) -> int:
        return super().life_ns() * 3 // 2


class LifeGuardingNeverRecovers(Fault, NodeGuarding):
    """After a life guarding event polls do not end the error."""

    violates = ("EC-02", "C-NG-08")

    def _recover(self, now: int) -> Frames:
        self._over_at = None
        return ()


class LifeTimeOfTheStart(Fault, NodeGuarding):
    """Guard time and life time factor that are written at run time have no effect."""

    violates = ("EC-02", "C-NG-11", "C-NG-06")

    def start(self, now: int) -> Frames:
        self.kept = super().life_ns()
        return super().start(now)

    def life_ns(self) -> int:
        return self.kept


class LifeGuardingWatchesOnce(Fault, NodeGuarding):
    """Polls after the first do not prolong the life time."""

    violates = ("EC-02", "C-NG-07")

    def _polled(self, now: int) -> Frames:
        before = self._lapse_at
        said = super()._polled(now)
        self._lapse_at = before or self._lapse_at
        return said


class LifeTimeFactorZeroIsOne(Fault, NodeGuarding):
    """The life time factor 0 counts as 1."""

    violates = ("EC-02", "C-NG-01")

    def life_ns(self) -> int:
        return self._od.number(0x100C) * MS * max(self._od.number(0x100D), 1)


FAULTS: tuple[type[Fault], ...] = (
    GuardingBesideHeartbeat,
    GuardingToggleBeginsWithOne,
    GuardingToggleStands,
    GuardingToggleEverySecondAnswer,
    GuardingToggleSurvivesReset,
    GuardingToggleResetByState,
    GuardingShowsPreOperational,
    GuardingSilentInStopped,
    GuardingAnswersForTheNext,
    GuardingAnswerOfTwoBytes,
    LifeGuardingWithoutPoll,
    LifeGuardingIsMissing,
    LifeTimeWithoutFactor,
    LifeTimeTooLong,
    LifeGuardingNeverRecovers,
    LifeTimeOfTheStart,
    LifeGuardingWatchesOnce,
    LifeTimeFactorZeroIsOne,
)
