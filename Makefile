# The map of what can be done here; `make help` prints it. Plain `make` sets up and runs the main job.
PYTHON ?= python3
CORES ?= 2
BIN := .venv/bin
READY := .venv/ready
# what docs/reference keeps of the campaign at the paper's fidelity
REFERENCE := soil repose shear strength screening reachability calibration iterations minima posterior equivalents \
	identifiability verification sensitivity coverage

# what `make docs` describes
API := dem dem.experiments dem.measure dem.contact dem.ledger virtual_soil

.DEFAULT_GOAL := campaign

campaign: setup  ## the whole method at its default settings: results/default/report.html
	$(BIN)/snakemake -c$(CORES) all

setup: $(READY)  ## virtual environment with the locked versions, package installed

$(READY): requirements.lock pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --requirement requirements.lock
	$(BIN)/pip install --quiet --no-deps --no-build-isolation --editable .
	touch $(READY)

test: setup lint  ## lint, all tests (kernels also uncompiled) and the smoke campaign
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest tests/dem/contact
	$(BIN)/pytest --numprocesses $(CORES)

test-slurm: setup  ## the smoke campaign on a real SLURM of two virtual nodes, started here; as root on Debian only
	tests/slurm/run.sh

lint: setup  ## style, types, workflow, spelling
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check Snakefile workflow
	$(BIN)/python .ci/lint_workflow.py
	$(BIN)/codespell

format: setup  ## rewrite Python and Snakemake files in the project's style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/snakefmt Snakefile workflow

status:  ## how far a campaign is, while it runs or after: STUDY=<name>, default if none is given
	@$(BIN)/python -m virtual_soil.campaign.status $(if $(STUDY),--study $(STUDY))

new-study: setup  ## start a study of your own: STUDY=<name>, and SOIL=<name> for one in config/soils
	@$(BIN)/python -m virtual_soil.campaign.new_study '$(STUDY)' $(SOIL)

smoke: setup  ## the whole workflow in a few minutes, with few grains
	$(BIN)/snakemake -c$(CORES) all --configfile config/smoke.yaml

paper: setup  ## the paper's exact fidelity: half an hour to an hour
	$(BIN)/snakemake -c$(CORES) all --configfile config/paper.yaml

reference: paper  ## the paper's exact fidelity again, and its tables and report into docs/reference
	cp $(addprefix results/paper/,$(addsuffix .parquet,$(REFERENCE)) surrogates.json report.html) docs/reference/

twin: setup  ## a hidden soil simulated, forgotten and calibrated at full size: is it found again?
	$(BIN)/snakemake -c$(CORES) all --configfile config/twin.yaml

first-answer: setup  ## a soil calibrated on docs/reference in seconds, without simulations: SOIL=<name or file>
	$(BIN)/snakemake -c$(CORES) first_answer --quiet host progress reason $(if $(SOIL),--config soil=$(SOIL))

check-results: setup  ## which files of a finished study are no longer as they were written: STUDY=<name>
	$(BIN)/snakemake -c1 check_manifest --quiet host progress reason $(if $(STUDY),--config study=$(STUDY))

check-engine: setup  ## the engine beside published and closed-form results: docs/verification.md
	$(BIN)/snakemake -c$(CORES) verification

paper-optima: setup  ## every minimum of the published surrogates beside those that the paper prints
	$(BIN)/python -m virtual_soil.calibration.paper.optima

bench: setup  ## speed of the engine beside LIGGGHTS and LAMMPS (those that are installed)
	$(BIN)/python benchmarks/engine.py

bench-quick: setup  ## speed of the engine alone, in under 45 s
	$(BIN)/python benchmarks/engine.py --quick

bench-scale: setup  ## cost per grain from 3000 to 300 000 grains; one large simulation on several threads
	$(BIN)/python benchmarks/scale.py

bench-planning: setup  ## what planning 50 to 5000 simulations takes, and what a job costs beside its simulation
	$(BIN)/python benchmarks/planning.py --run 300

check-peers: setup  ## heap, shear test and rolling contact beside LIGGGHTS (apt-get install liggghts)
	$(BIN)/python -m virtual_soil.verification.peers --cores $(CORES)

notebook: setup  ## the example notebook executed again, with what it shows
	$(BIN)/python docs/examples/execute.py

docs: setup  ## what the packages offer, from their docstrings: build/api/index.html
	$(BIN)/python -W error -m pdoc --docformat numpy --output-directory build/api $(API)

lock: setup  ## resolve the newest versions of all dependencies into requirements.lock
	$(BIN)/pip install --quiet pip-tools
	$(BIN)/pip-compile --quiet --upgrade --extra dev --extra cluster --allow-unsafe --no-header --no-annotate --no-emit-index-url --no-emit-find-links \
		--no-emit-trusted-host --output-file requirements.lock pyproject.toml

# former names
verify: check-engine

verify-peers: check-peers

settings: setup  ## write what follows from the settings' classes: config/schema.yaml, config/config.yaml, docs/configuration.md
	$(BIN)/python -m virtual_soil.campaign.generate

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):[^#]*## */\1\t/' | expand -t 12

.PHONY: campaign status new-study setup test test-slurm lint format smoke paper reference twin first-answer check-results \
	check-engine check-peers verify verify-peers settings paper-optima bench bench-quick bench-scale bench-planning notebook docs lock help
