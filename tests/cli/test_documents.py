"""README.md and docs/: what they tell users to write works, and their links lead somewhere."""

import itertools
import json
import os
import re
import shlex
import subprocess
import unittest

from support import SOURCE, CommandTest

DOCUMENTS = [SOURCE / "README.md", *sorted(SOURCE.glob("docs/**/*.md"))]
# Neither the lab's nor those that are generated.
USER_PAGES = [SOURCE / "README.md", *sorted(SOURCE.glob("docs/*.md")), SOURCE / "docs/gallery/README.md"]
# test_pages.py does all that these say, in their order: their blocks belong together.
WALKED = ("tutorial_artist.md", "tutorial_blender.md", "tutorial_dataset.md", "tutorial_researcher.md")
# A fragment of a scene is put into this to become a scene.
BASE = {
    "version": 1,
    "materials": {"wood": {}},
    "shapes": {"ground": {"type": "plane"}, "box": {"type": "box", "size": [0.1, 0.1, 0.1]}},
    "bodies": [{"name": "ground", "shape": "ground", "material": "wood", "role": "static"}],
}


def blocks(document, language):
    """(line, text) of the fenced blocks of one language; "" also has the indented ones."""
    text = document.read_text()
    for match in re.finditer(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S):
        if match[1] == language:
            yield text.count("\n", 0, match.start()) + 1, match[2]
    if language == "":
        for match in re.finditer(r"(?:^    .*\n)+", text, re.M):
            yield text.count("\n", 0, match.start()) + 1, match[0]


def commands(document):
    """(place, words) of every pilesim command in a document's blocks."""
    for language in ("", "sh", "text"):
        for line, text in blocks(document, language):
            variables = {}
            for command in text.replace("\\\n", " ").splitlines():
                command = command.strip()
                for name, value in re.findall(r"(?:^|; )([A-Z]+)=(\S+)", command):
                    variables[name] = value.rstrip(";")
                # Variables of loops are numbers.
                command = re.sub(r"\$(\w+)", lambda m: variables.get(m[1], "1"), command)
                command = re.sub(r"^[\w./]+/pilesim ", "pilesim ", command)
                if command.startswith("pilesim "):
                    lexer = shlex.shlex(command, posix=True, punctuation_chars="|&;<>")
                    lexer.whitespace_split = True
                    words = list(itertools.takewhile(lambda word: word[0] not in "|&;<>", lexer))
                    yield f"{document.name}:{line}: {command}", words[1:]


def anchor(heading):
    """The anchor of a heading, as GitHub makes it."""
    text = re.sub(r"[`*]|\[|\]\([^)]*\)", "", heading.strip()).lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def word_count(text):
    """Words, numbers and code among blanks. Bars of tables and marks of headings are none."""
    return sum(1 for word in text.split() if re.search(r"\w", word))


def sentences(document, tables=True):
    """The sentences of a document, and its headings and cells of tables. Without code blocks."""
    text = re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.M | re.S)
    for paragraph in re.split(r"\n\s*\n", text):
        if all(line.startswith("    ") for line in paragraph.splitlines()):
            continue
        rows = [line for line in paragraph.splitlines() if re.match(r"\s*[|#!]", line)]
        if tables:
            yield from (cell for row in rows for cell in row.split("|") if word_count(cell))
        rest = "\n".join(line for line in paragraph.splitlines() if line not in rows)
        for item in re.split(r"\n\s*(?:[-*]|\d+\.) ", "\n" + rest):
            yield from (part for part in re.split(r"(?<=[.!?])\s+", " ".join(item.split())) if word_count(part))


class Documents(CommandTest):
    def test_every_block_of_json_is_a_scene_or_a_part_of_one(self):
        count = 0
        for document in DOCUMENTS:
            if document.name in WALKED:
                continue
            for line, text in blocks(document, "json"):
                text = text.replace('"../assets/', f'"{SOURCE}/assets/')
                if text.lstrip().startswith('"'):
                    scene = {**BASE, **json.loads("{" + text + "}")}
                else:
                    scene = json.loads(text)
                    if "steps" in scene:
                        self.check_plan(text, f"{document.name}:{line}")
                        continue
                    if "version" not in scene:
                        self.fail(f"{document.name}:{line}: neither a scene nor keys of one")
                (self.dir / "scene.json").write_text(json.dumps(scene))
                result = self.run_pilesim("validate", "scene.json")
                self.assertEqual(result.returncode, 0, f"{document.name}:{line}: {result.stderr}")
                count += 1
        self.assertGreater(count, 3)

    def check_plan(self, text, where):
        (self.dir / "meshes").mkdir(exist_ok=True)
        (self.dir / "meshes/ring.obj").write_bytes((SOURCE / "assets/ring.obj").read_bytes())
        (self.dir / "example.plan.json").write_text(text.replace('"bin.json"', f'"{SOURCE}/presets/batch/bin.json"'))
        result = self.run_pilesim("batch", "example.plan.json", "-o", "none", "--collect")
        self.assertEqual(result.returncode, 0, f"{where}: {result.stderr}")

    def test_an_example_that_fills_its_guide_fills_it(self):
        for document in DOCUMENTS:
            for line, text in blocks(document, "json"):
                if "upside_down" not in text:
                    continue
                text = text.replace('"../assets/', f'"{SOURCE}/assets/')
                (self.dir / "scene.json").write_text(text)
                # A few bodies are enough to see that the guide takes any.
                quick = ["--set", "/duration_s=0.05", "--set", "/emitters/0/count=10"]
                self.succeed("direct-pile", "scene.json", "-o", f"out{line}", *quick)

    def test_commands_are_taken_by_the_program(self):
        """Each of them as it stands, where no file is: what is misused is said before files are looked for. In the lab, which has
        many that differ in a number, each of other options."""
        tried = set()
        for document in DOCUMENTS:
            for place, words in commands(document):
                if words[0] == "reproduce":  # needs no files that are not there
                    words.append("--dry-run")
                told = words
                if document.parent.name == "lab":
                    told = words[:1] + [word for word in words if word.startswith("-")]
                if tuple(told) in tried or "reference" in words:
                    continue
                tried.add(tuple(told))
                where = self.dir / str(len(tried))
                where.mkdir()
                result = self.run_pilesim(*words, cwd=where)
                self.assertIn(result.returncode, (0, 3, 4), f"{place}: {result.stderr}")
        self.assertGreater(len(tried), 130)

    def test_overrides_of_presets_are_valid(self):
        tried = set()
        for document in DOCUMENTS:
            for place, words in commands(document):
                if words[0] not in ("simulate", "direct-pile", "compare"):
                    continue
                if not words[1].startswith("presets/"):
                    continue
                sets = [w for i, w in enumerate(words) if "--set" in (w, words[i - 1])]
                if not sets or (words[1], *sets) in tried:
                    continue
                tried.add((words[1], *sets))
                result = self.run_pilesim("validate", SOURCE / words[1], *sets)
                self.assertEqual(result.returncode, 0, f"{place}: {result.stderr}")
        self.assertGreater(len(tried), 5)

    def test_scripts_run(self):
        names = subprocess.run(["git", "ls-files"], cwd=SOURCE, capture_output=True, text=True)
        files = [SOURCE / name for name in names.stdout.splitlines()]
        for pattern in ("presets/**/*.py", "presets/**/*.sh", "tests/**/*.py", "*.sh"):
            files += SOURCE.glob(pattern)
        scripts = {file for file in files if file.is_file() and file.read_bytes()[:2] == b"#!"}
        self.assertGreater(len(scripts), 2)
        for script in sorted(scripts):
            self.assertTrue(os.access(script, os.X_OK), script)

    def test_links_lead_somewhere(self):
        for document in DOCUMENTS:
            text = re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.M | re.S)
            for target in re.findall(r"\]\(([^)\s]+)\)", text):
                if re.match(r"[a-z]+:", target):
                    continue
                path, _, part = target.partition("#")
                file = document.parent / path if path else document
                self.assertTrue(file.exists(), f"{document.name}: {target}")
                if part:
                    headings = re.findall(r"^#+ (.*)$", file.read_text(), re.M)
                    anchors = [anchor(heading) for heading in headings]
                    self.assertIn(part, anchors, f"{document.name}: {target}")

    def test_the_gallery_names_all_presets(self):
        page = (SOURCE / "docs/gallery/README.md").read_text()
        presets = {file.relative_to(SOURCE).as_posix() for file in SOURCE.glob("presets/**/*.json")}
        self.assertGreater(len(presets), 80)
        self.assertEqual(set(re.findall(r"presets/[\w/.]+\.json", page)), presets)

    def test_pages_have_pictures(self):
        for page in USER_PAGES:
            self.assertRegex(page.read_text(), r"!\[[^]]+\]\([^)]+\.(?:jpg|webp|png)\)", page.name)

    def test_pictures_are_small_and_on_pages(self):
        linked = {(page.parent / path).resolve() for page in DOCUMENTS for path in re.findall(r"\]\(([^)\s#]+)", page.read_text())}
        pictures = {file for folder in ("gallery", "pictures") for file in (SOURCE / "docs" / folder).iterdir() if file.suffix not in (".md", ".py", ".sh")}
        self.assertEqual(pictures - linked, set())
        self.assertLess(sum(file.stat().st_size for file in pictures if file.parent.name == "gallery"), 12_000_000)
        for file in pictures:
            if file.suffix == ".webp":
                self.assertLess(file.stat().st_size, 1_500_000, file.name)

    def test_measurements_name_their_conditions(self):
        """A page with measured times or errors says when and on which machine, and how to measure again."""
        for document in USER_PAGES:
            text = document.read_text()
            measured = re.search(r"^\|.*\d (?:s|ms|µs|mm) \|", text, re.M)
            if measured:
                found = re.search(r"[Mm]easured\sin\s\w+\s20\d\d\son\s", text)
                self.assertTrue(found, f"{document.name}: {measured[0]}")
                programs = r"(?:pilesim|\w+_benchmark|\w+\.py|\w+\.sh|unit_\w+) "
                self.assertRegex(text, rf"(?m)^    (?:.*[ /])?{programs}|^```(?:sh)?\n.*{programs}", document.name)


class Language(unittest.TestCase):
    """The language of user pages, as far as a machine can tell (CONTRIBUTING.md)."""

    # The glossary's terms stand for them: docs/glossary.md.
    WORDS = "anew|thrice|till|so all the same|sunk|rouse[sd]?|blows?|dozing|haste|formerly|previously"

    def expect_none(self, pattern, texts, flags=0):
        for document, text in texts:
            found = re.search(pattern, text, flags)
            self.assertIsNone(found, f"{document.name}: {found and text[max(0, found.start() - 40) : found.end() + 40]}")

    def test_pages_name_no_commits(self):
        texts = [(page, page.read_text()) for page in USER_PAGES]
        self.expect_none(r"\b(?=\d*[a-f])(?=[a-f]*\d)[0-9a-f]{7,40}\b", texts)

    def test_words_are_those_of_the_glossary(self):
        texts = [(page, page.read_text()) for page in USER_PAGES]
        self.expect_none(rf"\b(?:{self.WORDS})\b", texts, re.I)

    def test_no_sentence_begins_with_of_or_what(self):
        texts = [(page, sentence) for page in USER_PAGES for sentence in sentences(page)]
        self.assertGreater(len(texts), 1000)
        self.expect_none(r"^\W*(?:Of|What)\b", texts)

    def test_sentences_are_short(self):
        for page in USER_PAGES:
            lengths = [word_count(sentence) for sentence in sentences(page, tables=False)]
            self.assertLessEqual(sum(lengths), 25 * len(lengths), page.name)

    # Plain words between blanks, as `wc -w` counts them.
    def test_pages_are_short(self):
        readme = len((SOURCE / "README.md").read_text().split())
        self.assertLess(readme, 900)
        self.assertLess(readme + sum(len(page.read_text().split()) for page in SOURCE.glob("docs/*.md")), 25_000)

    def test_each_term_of_the_glossary_stands_once(self):
        terms = [term for row in re.findall(r"^\| ([^|]+) \|", (SOURCE / "docs/glossary.md").read_text(), re.M)[1:] for term in row.split(", ")]
        self.assertGreater(len(terms), 30)
        self.assertEqual(len(terms), len(set(terms)))

    def test_pages_of_the_laboratory_are_short(self):
        self.assertLess(sum(len(page.read_text().split()) for page in SOURCE.glob("docs/lab/*.md")), 12_000)


class CodeLanguage(unittest.TestCase):
    """The language of comments (CONTRIBUTING.md)."""

    FOLDERS = ("commands", "presets", "reproduce", "shaders", "src", "tests")
    SUFFIXES = (".cpp", ".frag", ".glsl", ".h", ".js", ".py", ".vert")
    WORDS = "anew|thrice|till|so all the same|sunk|stuck|rouse[sd]?|blows?|dozing|haste"

    def comments(self, file):
        """(line, text) of comments, those of adjacent lines in one; of a script also its docstrings."""
        mark = "#" if file.suffix == ".py" else "//"
        text = file.read_text()
        found = [(text.count("\n", 0, m.start()) + 1, m[1]) for m in re.finditer(r'"""(.*?)"""', text, re.S) if mark == "#"]
        begin, last = 0, -1
        for number, line in enumerate(text.splitlines(), 1):
            match = re.search(rf"(?:^|\s){mark} (.*)$", line)
            if not match:
                continue
            if number == last + 1 and not line[: match.start()].strip():
                found[-1] = begin, f"{found[-1][1]} {match[1]}"
            else:
                begin = number
                found.append((begin, match[1]))
            last = number
        return found

    def files(self):
        found = [file for folder in self.FOLDERS for file in sorted((SOURCE / folder).rglob("*")) if file.suffix in self.SUFFIXES]
        self.assertGreater(len(found), 900)
        return found

    def test_pages_that_comments_name_exist(self):
        missing = [
            f"{file.relative_to(SOURCE)}:{line}: {page}"
            for file in self.files()
            for line, text in self.comments(file)
            for page in re.findall(r"docs/[\w/]+\.md", text)
            if not (SOURCE / page).exists()
        ]
        self.assertEqual(missing, [])

    def test_comments_are_in_plain_words(self):
        wrong = rf"(?:^|[.!?] )(?:Of|What)\b.{{0,40}}|\b(?i:{self.WORDS})\b"
        found = [
            f"{file.relative_to(SOURCE)}:{line}: {match[0]}"
            for file in self.files()
            for line, text in self.comments(file)
            if (match := re.search(wrong, " ".join(text.split())))
        ]
        self.assertEqual(found, [])


if __name__ == "__main__":
    unittest.main()
