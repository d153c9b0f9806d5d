"""Executors: where shards run. Our own pool of processes, one of the user, or a Dask cluster that runs already.

Nothing listens here: processes of a pool talk by pipes; a cluster was started by its user.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    as_completed,
    wait,
)
from contextlib import contextmanager
from multiprocessing.connection import wait as wait_for_end
from typing import Any, Protocol

from omnidyn.compiled.parallel import processors
from omnidyn.errors import InputError, MissingExtraError, OmnidynError

RETRIES = 3  # of a shard on Dask whose worker was lost
ENDED = "the process that worked on this shard ended: it called exit, crashed, or the system ended it (out of memory?)"

Call = Callable[..., None]
Calls = Iterable[tuple[int, tuple[Any, ...]]]


class ShardPool(Protocol):
    """Where shards run. workers: how many at once; 1 where nobody says."""

    workers: int

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function gives in a process that works; None where it fails."""
        ...

    def run(self, function: Call, calls: Calls) -> Iterator[tuple[int, str]]:
        """(shard, "") of each call as it ends, or why it has none of its own words. Raises what `function` raises."""
        ...


@contextmanager
def opened(executor: Executor | None, scheduler: str, workers: int | None) -> Iterator[ShardPool]:
    """The pool that was asked for; ours is closed in the end, and its processes with it."""
    if executor is not None:
        yield Given(executor)
    elif scheduler:
        with _dask(scheduler) as client:
            yield Given(client.get_executor(retries=RETRIES), "the Dask scheduler")
    else:
        pool = Processes(workers or processors())
        try:
            yield pool
        finally:
            pool.close()


@contextmanager
def _dask(scheduler: str) -> Iterator[Any]:
    """A client of a Dask cluster. Raises InputError where there is none at this address."""
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtraError("a Dask cluster needs distributed", remedy='pip install "omnidyn[cluster]"') from None
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(
            "no Dask scheduler there",
            got=str(error) or scheduler,
            expected="tcp://HOST:PORT of one that runs",
            remedy="start one with `dask scheduler`, and workers with `dask worker`",
            where="scheduler",
        ) from None
    with _quiet("distributed"):
        try:
            yield client
        finally:
            client.close()


@contextmanager
def _quiet(library: str) -> Iterator[None]:
    """Within it a library logs nothing: what happens to a cluster is said in one sentence, not as tracebacks."""
    loggers = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith(library)]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


class Given:
    """An executor of the user: it gets all shards at once, and is left as it was. name: what it is called."""

    def __init__(self, executor: Executor, name: str = "the executor") -> None:
        self.executor, self._name, self.workers = executor, name, getattr(executor, "_max_workers", 1)

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function gives; None where it fails."""
        try:
            return self.executor.submit(function, *arguments).result()
        except Exception:
            return None

    def run(self, function: Call, calls: Calls) -> Iterator[tuple[int, str]]:
        """See ShardPool."""
        futures = {self.executor.submit(function, *arguments): shard for shard, arguments in calls}
        try:
            for future in as_completed(futures):  # `wait` would look at all that are left for each that ends
                yield futures[future], self._words(future)
        except BaseException as raised:
            running = [future for future in futures if not future.done() and not future.cancel()]
            if isinstance(raised, Exception):  # nobody may write any more when this has ended; an interrupt waits not
                wait(running)
            raise

    def _words(self, future: Future[None]) -> str:
        """Why a call failed, where it could not say so itself. Raises what ends all."""
        try:
            future.result()
        except OmnidynError:
            raise
        except (BrokenExecutor, CancelledError) as error:
            raise OmnidynError(
                f"{self._name} has ended",
                got=type(error).__name__,
                remedy="start it again and go on with `resume`: what is done stays",
            ) from error
        except Exception:  # such as a worker of Dask that ended again and again
            return f"{ENDED}\n{traceback.format_exc()}"
        return ""


class Processes:
    """Our own pool. A process that ends breaks a pool of Python: the shards in flight are then run one by one."""

    def __init__(self, workers: int) -> None:
        if workers < 1:
            raise InputError("no workers", got=workers, expected="1 or more", where="workers")
        self.workers, self._pool = workers, None
        self._strangers = set(multiprocessing.active_children())

    def _made(self, workers: int) -> ProcessPoolExecutor:
        # spawn: what is forked while threads run may wait for ever
        context = multiprocessing.get_context("spawn")
        return ProcessPoolExecutor(workers, context, initializer=_begin_worker)

    def _ready(self) -> ProcessPoolExecutor:
        """The pool, made and tried. Raises InputError where processes cannot be started."""
        if self._pool is None:
            pool = self._made(self.workers)
            try:
                pool.submit(os.getpid).result()
            except BrokenExecutor:
                raise InputError(
                    "processes cannot be started",
                    expected="a program that can be imported",
                    remedy='put the call under: if __name__ == "__main__":',
                ) from None
            self._pool = pool
        return self._pool

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function gives; None where it fails."""
        try:
            return self._ready().submit(function, *arguments).result()
        except InputError:
            raise
        except BrokenExecutor:
            self.close()
        except Exception:
            pass
        return None

    def run(self, function: Call, calls: Calls) -> Iterator[tuple[int, str]]:
        """See ShardPool. Two shards a process are in flight, so that none waits and few are suspects."""
        queue, futures = iter(calls), dict[Future[None], tuple[int, tuple[Any, ...]]]()
        while True:
            suspects = [*futures.values()]
            try:
                while len(futures) < 2 * self.workers and (call := next(queue, None)):
                    suspects.append(call)
                    futures[self._ready().submit(function, *call[1])] = call
                if not futures:
                    return
                for future in wait(futures, return_when=FIRST_COMPLETED).done:
                    future.result()
                    yield futures.pop(future)[0], ""
            except BrokenExecutor:
                self.close()
                futures = {}
                for shard, arguments in suspects:
                    yield shard, self._alone(function, arguments)

    def _alone(self, function: Call, arguments: tuple[Any, ...]) -> str:
        """Run a shard in a process of its own: why it has no words, "" where it ended well."""
        pool = self._made(1)
        try:
            pool.submit(function, *arguments).result()
        except BrokenExecutor:
            return ENDED
        finally:
            pool.shutdown(cancel_futures=True)
        return ""

    def close(self) -> None:
        """End the processes, whatever they do."""
        for process in set(multiprocessing.active_children()) - self._strangers:
            process.terminate()
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
            self._pool = None


def _begin_worker() -> None:
    """A process of the pool: Ctrl-C is for its parent alone, and it ends with that, even where nobody tells it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    """End this process when another one has ended."""
    wait_for_end([sentinel])
    os._exit(1)
