"""The paper's runs simulated again, and their analysis next to the published one."""
