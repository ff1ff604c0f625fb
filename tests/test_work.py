"""Threads: everything done once, errors and stops passed on, maps within maps."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import suppress

import pytest

import fracslice.work
from fracslice.errors import Cancelled
from fracslice.work import Work, ahead, in_background


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_every_item_is_done_once(threads: int) -> None:
    done: list[int] = []
    Work(threads).map(done.append, range(1000))
    assert sorted(done) == list(range(1000))


@pytest.mark.parametrize("threads", [1, 3])
def test_an_error_is_raised_and_ends_the_work(threads: int) -> None:
    done: list[int] = []

    def task(item: int) -> None:
        if item == 10:
            raise IndexError(item)
        done.append(item)
        threading.Event().wait(1e-3)

    work = Work(threads)
    with pytest.raises(IndexError):
        work.map(task, range(1000))
    assert len(done) < 100
    work.map(done.append, range(3))  # which was no cancellation


def test_several_threads_work_at_once() -> None:
    meeting = threading.Barrier(3, timeout=20)
    Work(3).map(lambda _: meeting.wait() and None, range(3))


def test_as_many_threads_as_asked_for_work_at_once() -> None:
    """Though each of them calls only a few others."""
    meeting = threading.Barrier(16, timeout=20)
    Work(16).map(lambda _: meeting.wait() and None, range(16))


def test_quick_tasks_call_few_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Calling one takes longer than such a task."""
    called: list[int] = []
    pool, submit = fracslice.work.POOL, fracslice.work.POOL.submit
    monkeypatch.setattr(pool, "submit", lambda task: called.append(1) or submit(task))
    for _ in range(20):
        Work(64).map(lambda _: None, range(64))
    assert len(called) < 20 * 16


def test_maps_within_maps() -> None:
    done: list[tuple[int, int]] = []
    work = Work(4)
    work.map(lambda i: work.map(lambda j: done.append((i, j)), range(20)), range(20))
    assert len(set(done)) == len(done) == 400


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_ordered_results_keep_to_the_number_of_threads(threads: int) -> None:
    lock, busy, most = threading.Lock(), 0, 0

    def task(item: int) -> int:
        nonlocal busy, most
        with lock:
            busy += 1
            most = max(most, busy)
        threading.Event().wait(1e-3 * (item % 3))
        with lock:
            busy -= 1
        return item

    assert list(Work(threads).ordered(task, range(50))) == list(range(50))
    assert most <= threads


def test_ordered_results_are_complete_if_callbacks_are_late(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy machine a result can be read long before the callbacks of its future run."""
    real = Future._invoke_callbacks  # type: ignore[attr-defined]

    def late(future: Future[int]) -> None:
        threading.Event().wait(0.02)
        real(future)

    def task(item: int) -> int:
        threading.Event().wait(0.005)
        return item

    monkeypatch.setattr(Future, "_invoke_callbacks", late)
    assert list(Work(2).ordered(task, range(20))) == list(range(20))


def test_ordered_results_within_tasks_do_not_wait_for_each_other() -> None:
    """More tasks than workers: each would wait for one that never begins."""
    work = Work(1000)
    inner = work.collect(lambda i: sum(work.ordered(lambda j: i * j, range(4))), range(600))
    assert inner == [6 * i for i in range(600)]
    assert sum(work.ordered(lambda i: sum(work.ordered(lambda j: j, range(3))), range(600))) == 1800


def test_ordered_results_end_with_the_first_error() -> None:
    begun: list[int] = []

    def task(item: int) -> int:
        begun.append(item)
        return 1 // (item - 10)

    with pytest.raises(ZeroDivisionError):
        list(Work(3).ordered(task, range(1000)))
    assert len(begun) < 100
    assert begun.count(10) == 1


def test_cancelled_work_stops() -> None:
    done: list[int] = []
    work = Work(2)

    def task(item: int) -> None:
        done.append(item)
        work.cancel.set()

    with pytest.raises(Cancelled):
        work.map(task, range(1000))
    assert len(done) <= 2


def test_the_next_item_is_computed_while_one_is_used() -> None:
    used = threading.Event()

    def items() -> Iterator[str]:
        yield "first"
        assert used.wait(10)
        yield "last"

    coming = ahead(items())
    assert next(coming) == "first"
    used.set()
    assert list(coming) == ["last"]


def test_an_error_of_the_next_item_reaches_the_consumer_of_the_first() -> None:
    def items() -> Iterator[int]:
        yield 1
        raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        list(ahead(items()))


def test_an_error_of_the_consumer_waits_for_the_next_item() -> None:
    done = list[str]()

    def items() -> Iterator[int]:
        yield 1
        threading.Event().wait(0.05)
        done.append("next")
        yield 2

    coming = ahead(items())
    next(coming)
    coming.close()  # type: ignore[attr-defined]
    assert done == ["next"]


@pytest.mark.parametrize("threads", [1, 2])
def test_a_task_beside_is_computed_once(threads: int) -> None:
    calls: list[threading.Thread] = []

    def task() -> int:
        calls.append(threading.current_thread())
        return 7

    with in_background(task, threads) as result:
        assert result() == result() == 7
    assert len(calls) == 1 and (calls[0] is threading.current_thread()) == (threads == 1)


def test_a_task_beside_ends_before_its_block_does() -> None:
    begun, ended = threading.Event(), threading.Event()

    def task() -> None:
        begun.set()
        time.sleep(0.05)
        ended.set()

    with suppress(ZeroDivisionError), in_background(task, 2):
        assert begun.wait(60)
        raise ZeroDivisionError
    assert ended.is_set()


def test_errors_of_a_task_beside_are_raised_where_its_result_is_wanted() -> None:
    with in_background(lambda: [0][1], 2) as result, pytest.raises(IndexError):
        result()


def test_work_goes_on_with_the_threads_that_fit_into_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tasks that wait for others included: nothing waits for a thread that never comes."""
    start, started = threading.Thread.start, list[threading.Thread]()

    def scarce(thread: threading.Thread) -> None:
        if started:
            raise RuntimeError("can't start new thread")
        started.append(thread)
        start(thread)

    pool = type(fracslice.work.POOL)(256, initializer=fracslice.work._mark)
    monkeypatch.setattr(fracslice.work, "POOL", pool)
    monkeypatch.setattr(threading.Thread, "start", scarce)

    def nested(item: int) -> int:
        with in_background(lambda: item, 8) as result:
            return result()

    done: list[int] = []
    Work(8).map(done.append, range(100))
    assert sorted(done) == list(range(100))
    assert list(Work(8).ordered(str, range(50))) == list(map(str, range(50)))
    assert list(ahead(map(nested, range(1, 9)))) == list(range(1, 9))
    assert len(started) == 1
    pool.shutdown()
