"""What a program's limit of friction has to do with the one that was calibrated."""

#: Program -> its limit of friction, where that is a value of `engine.tangential_model`.
OF_PROGRAM = {"LIGGGHTS": "liggghts"}


def explanation(card: dict, program: str) -> list[str]:
    """Lines for the program's file: nothing where the limits are the same, or where nothing is known of the program's."""
    calibrated, own = card["models"]["tangential"].get("type"), OF_PROGRAM.get(program)
    if calibrated == own:
        return []
    if own is not None:
        return [
            f"{program} limits friction otherwise: the spring alone obeys Coulomb, and the dashpot acts on top of it while a",
            f"contact sticks. A study with engine.tangential_model: {own} calibrates this law.",
        ]
    if calibrated in OF_PROGRAM.values():
        return ["Calibrated with the limit of friction of LIGGGHTS (engine.tangential_model), which this file does not carry over."]
    return []
