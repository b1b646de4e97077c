"""Small wrong changes to C++ sources, one at a time."""

import random
import re
from dataclasses import dataclass
from pathlib import Path

SWAPS = [
    (re.compile(r"(?<=[\w)\]] )\+(?= [\w(\-])"), "-"),
    (re.compile(r"(?<=[\w)\]] )-(?= [\w(])"), "+"),
    (re.compile(r"(?<=[\w)\]] )\*(?= [\w(\-])"), "/"),
    (re.compile(r"(?<=[\w)\]] )/(?= [\w(])"), "*"),
    (re.compile(r"(?<=[\w)\]] )\+=(?= )"), "-="),
    (re.compile(r"(?<=[\w)\]] )-=(?= )"), "+="),
    (re.compile(r"(?<= )<=(?= )"), "<"),
    (re.compile(r"(?<= )>=(?= )"), ">"),
    (re.compile(r"(?<=[\w)\]] )<(?= [\w(\-])"), "<="),
    (re.compile(r"(?<=[\w)\]] )>(?= [\w(\-])"), ">="),
    (re.compile(r"(?<= )==(?= )"), "!="),
    (re.compile(r"(?<= )!=(?= )"), "=="),
    (re.compile(r"(?<= )&&(?= )"), "||"),
    (re.compile(r"(?<= )\|\|(?= )"), "&&"),
    (re.compile(r"\bmin(?=\(|Coeff\(|_element\()"), "max"),
    (re.compile(r"\bmax(?=\(|Coeff\(|_element\()"), "min"),
    (re.compile(r"\bcwiseMin(?=\()"), "cwiseMax"),
    (re.compile(r"\bcwiseMax(?=\()"), "cwiseMin"),
]
NUMBER = re.compile(r"(?<![\w.\"'])(\d+\.?\d*(?:e-?\d+)?)(F|U|UL|L)?(?![\w.\"'])")
STATEMENT = re.compile(r"^ +(?!return|const |auto |using |static |case |throw |delete )"
                       r"[\w.:\->\[\]()*]+(?: [-+*/|&]?= .+|\(.*\));$")
CONDITION = re.compile(r"\bif \((?!constexpr)(.+)\)(?= \{$| \w.*;$)")


@dataclass(frozen=True)
class Mutant:
    file: str  # as it was given
    line: int  # from 1
    column: int  # from 0
    before: str
    after: str

    @property
    def key(self):
        return f"{self.file}:{self.line}:{self.column}: {self.before} -> {self.after or 'nothing'}"

    def apply(self, text):
        lines = text.split("\n")
        line = lines[self.line - 1]
        end = self.column + len(self.before)
        if line[self.column:end] != self.before:
            raise ValueError(f"{self.file}:{self.line} has changed")
        lines[self.line - 1] = line[:self.column] + self.after + line[end:]
        return "\n".join(lines)


def without_text(source):
    """Comments and literals of text as blanks, so that columns stay."""
    blank = lambda match: re.sub(r"[^\n]", " ", match.group())
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', blank, source,
                  flags=re.S)


def is_balanced(text):
    return text.count("(") == text.count(")")


def scaled(number, factor):
    if re.fullmatch(r"\d+", number):
        value = int(number) * factor
        return str(int(value)) if value == int(value) else str(value)
    return repr(float(number) * factor)


def mutants_of_line(line):
    """(column, before, after) of a line without comments and text."""
    if line.startswith(("#", "namespace", "using", "template")) or "static_assert" in line:
        return
    if "assert(" in line:
        return
    for pattern, other in SWAPS:
        for match in pattern.finditer(line):
            yield match.start(), match.group(), other
    for match in NUMBER.finditer(line):
        number = match.group(1)
        # Not 0, and no index, size of an array or argument of a template.
        if float(number) == 0 or line[match.start() - 1] in "[<" or line[match.end():][:1] in "]>":
            continue
        for factor in (2, 0.5):
            after = scaled(number, factor)
            if match.group(2) or "." in number or "e" in number or factor == 2 or int(number) > 1:
                suffix = match.group(2) or ""
                if suffix == "F" and "." not in after and "e" not in after:
                    after += ".0"
                if "U" in suffix and "." in after:
                    continue
                yield match.start(), match.group(), after + suffix
    if STATEMENT.match(line) and is_balanced(line):
        start = len(line) - len(line.lstrip())
        yield start, line.strip(), ";"
    for match in CONDITION.finditer(line):
        if is_balanced(match.group(1)) and ";" not in match.group(1):
            yield match.start(1), match.group(1), f"!({match.group(1)})"


def mutants_of(root, file):
    source = (Path(root) / file).read_text()
    plain = without_text(source).split("\n")
    lines = source.split("\n")
    for number, line in enumerate(plain):
        for column, before, after in mutants_of_line(line.rstrip()):
            # Text in a condition or statement is kept.
            whole = lines[number][column:column + len(before)]
            if whole != before:
                after = after.replace(before, whole)
            if after == ";" and '"' in whole:
                continue
            yield Mutant(str(file), number + 1, column, whole, after)


def choose(mutants, sample, seed):
    """In an order that depends on the seed alone, so that a part of a run is a fair sample."""
    mutants = sorted(mutants, key=lambda m: m.key)
    random.Random(seed).shuffle(mutants)
    return mutants[:sample] if sample else mutants
