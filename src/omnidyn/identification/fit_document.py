"""What a fit to whole logs says: its tables and words, and its values for machines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from omnidyn.document import Document, Part, Points, Table, apart, interval_cell
from omnidyn.findings.finding import Verdict
from omnidyn.identification.estimate import NOT_DETERMINED
from omnidyn.identification.lack_of_fit import Diagnosis, LackOfFit
from omnidyn.identification.log_verdicts import checked
from omnidyn.identification.methods import OUTPUT_ERROR
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.steady.group_numbers import Difference
from omnidyn.identification.validation import Validation
from omnidyn.model.actuation import DEAD_BAND
from omnidyn.model.keys import in_words, unit
from omnidyn.statement import ERROR, WARNING, Statement

SHOWN_FINDINGS = 6  # findings of a log that are named
MOST_LOGS = 20  # that are shown, one by one


def fit_document(
    fits: Mapping[str, OutputErrorEstimate],
    validations: Mapping[str, Validation],
    differences: Sequence[Difference],
    verdicts: Sequence[Verdict],
    advice: Sequence[Statement],
) -> Document:
    """The fit of each group beside its logs, the differences between groups, and what to do next."""
    blocks: list[Sequence[Part]] = []
    groups, last = {}, [*fits][-1:]  # all have the same ladder
    for group, fit in fits.items():
        validation_documents = [validations[group].document()] if group in validations else []
        documents = [fit.document(), *validation_documents]
        diagnosis, lack = fit.diagnosis, fit.lack_of_fit
        blocks += [[f"group {group}"] if len(fits) > 1 else [], *(document.parts for document in documents)]
        blocks += [[Points([fit.held_out.statement()])]] if fit.held_out else []
        blocks += [fit.ladder.parts()] if fit.ladder and group in last else []
        blocks += _found(lack, diagnosis) if diagnosis and lack and not fit.not_followed else []
        groups[group] = {
            **fit.to_dict(),
            "validation": validation_documents[0].data if validation_documents else None,
            "lack_of_fit": lack.to_dict() if lack else None,
            "rests_on": fit.rests_on,
            "stability": diagnosis.stability.to_dict() if diagnosis else None,
        }
    blocks.append([difference_table(differences)] if differences else [])
    blocks.append(["next:", Points(advice, name="next")] if advice else [])
    data = {
        "method": OUTPUT_ERROR,
        **(next(iter(groups.values())) if len(groups) == 1 else {"groups": groups}),
        "differences": [{**vars(difference), "differs": difference.differs} for difference in differences],
        "next": advice,
        "check": checked(verdicts),
    }
    return Document(apart(*blocks), data, [words for fit in fits.values() for words in fit.warnings], ascii=True)


def _found(lack: LackOfFit, diagnosis: Diagnosis) -> list[Sequence[Part]]:
    """What the model leaves out, what is not the same throughout the logs, and what the numbers rest on."""
    sensitivity_table, stability = diagnosis.table(), diagnosis.stability
    return [
        lack.parts(),
        stability.parts(),
        ["what each number rests on:", sensitivity_table] if sensitivity_table else [],
    ]


def number_table(fit: OutputErrorEstimate) -> Table:
    """Every fitted number, those of the log too, by its plain name and by its key."""
    rows = []
    for name, value in fit.value.items():
        words = in_words(name) if in_words(name) != name else ""
        if name in fit.unidentifiable:
            rows.append((words, name, f"{value:.5g}", "", "", unit(name), NOT_DETERMINED))
            continue
        mark = "at bound" if name in fit.at_bound else ""
        std, interval = f"{fit.std[name]:.2g}", interval_cell(fit.ci95[name])
        rows.append((words, name, f"{value:.5g}", std, interval, unit(name), mark))
    for name, nuisance in fit.nuisances.items():
        if name in fit.unidentifiable:
            rows.append(("", name, f"{nuisance.value:.4g}", "", "", nuisance.unit, NOT_DETERMINED))
        else:
            rows.append(
                (
                    "",
                    name,
                    f"{nuisance.value:.4g}",
                    f"{nuisance.std:.2g}",
                    interval_cell(nuisance.ci95),
                    nuisance.unit,
                    _whose(name),
                )
            )
    rows += [
        (
            str(combination.statement()),
            combination.name,
            f"{combination.value:.5g}",
            f"{combination.std:.2g}",
            interval_cell(combination.ci95),
            combination.unit,
            "together",
        )
        for combination in fit.combinations
    ]
    return Table(("number", "key", "value", "std error", "95 % interval", "unit", ""), rows, "<<>>><<")


def short_table(fit: OutputErrorEstimate) -> Table:
    """Every fitted number with its 95 % interval, by its plain name."""
    rows = [
        (words or name, value, mark if mark == NOT_DETERMINED else interval, unit)
        for words, name, value, _, interval, unit, mark in number_table(fit).rows[: len(fit.value) + len(fit.nuisances)]
    ]
    return Table(("number", "value", "95 % interval", "unit"), rows, "<>>")


def _whose(name: str) -> str:
    """What a number belongs to that was fitted beside those of the file: a dead band is of the driver."""
    return "of the driver" if name == DEAD_BAND else "of the log"


def difference_table(differences: Sequence[Difference]) -> Table:
    """What differs between groups, and what may."""
    rows = [
        (
            d.key,
            f"{d.first} {d.values[0]:.4g}",
            f"{d.second} {d.values[1]:.4g}",
            f"{d.difference:+.4g}",
            f"{d.std:.2g}",
            interval_cell((d.low, d.high)),
            unit(d.key),
            "differs" if d.differs else "no difference seen",
            in_words(d.key),
        )
        for d in differences
    ]
    return Table(
        ("number", "first", "second", "difference", "std error", "95 % interval", "unit", "", "in words"), rows
    )


def verdict_table(verdicts: Sequence[Verdict]) -> Table:
    """What `check` says of each log; of many logs the gravest, then a line for the rest."""
    rows, listed_verdicts = [], list(verdicts)
    if len(listed_verdicts) > MOST_LOGS:
        listed_verdicts = sorted(
            listed_verdicts, key=lambda verdict: (-verdict.counts[ERROR], -verdict.counts[WARNING])
        )[: MOST_LOGS - 1]
    for listed_verdict in listed_verdicts:
        grave_findings = [
            f for f in listed_verdict.findings if f.severity in (ERROR, WARNING) or f.code == "judged_again"
        ]
        finding_names = [f"{f.code} {f.subject}".rstrip() for f in grave_findings]
        words = ", ".join(finding_names[:SHOWN_FINDINGS]) + (", ..." if len(finding_names) > SHOWN_FINDINGS else "")
        rows.append(
            (
                listed_verdict.source,
                str(listed_verdict.rows),
                f"{listed_verdict.duration:.4g}",
                f"{listed_verdict.rate:.4g}",
                str(listed_verdict.counts[ERROR]),
                str(listed_verdict.counts[WARNING]),
                words or "fit for use",
            )
        )
    omitted_count = len(verdicts) - len(listed_verdicts)
    if omitted_count:
        fit = len(verdicts) - sum(verdict.counts[ERROR] + verdict.counts[WARNING] > 0 for verdict in verdicts)
        ending = f"no worse than these; of all {len(verdicts)} logs, {fit} have no error or warning"
        rows.append((f"and {omitted_count} more", "", "", "", "", "", ending))
    return Table(("log", "rows", "length s", "rate Hz", "errors", "warnings", "what"), rows)
