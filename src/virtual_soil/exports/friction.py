"""What a program's limit of friction has to do with the one that was calibrated."""

#: Program with the limit of the same name.
OF_PROGRAM = {"LIGGGHTS": "liggghts"}


def explanation(card: dict, program: str) -> list[str]:
    """Lines for the program's file: nothing where the limits are the same, or where nothing is known of the program's."""
    calibrated, own = card["models"]["tangential"].get("type", "edem"), OF_PROGRAM.get(program, "edem")
    if calibrated == own:
        return []
    if calibrated == "edem":
        return [
            f"{program} limits friction otherwise: the spring alone obeys Coulomb, and the dashpot acts on top of it while a",
            f"contact sticks. A study with engine.tangential_model: {own} calibrates this law.",
        ]
    return ["Calibrated with the limit of friction of LIGGGHTS (engine.tangential_model), which this program does not have."]
